//! The axes of this board: which pins, channels, counters and timers belong to each.

use super::board::{Board, Current, CurrentOf, GATES};
use super::converter::Channel;
use super::counter::Quadrature;
use super::gates;
use super::gpio::Wire;
use super::pwm::{self, Compare, MainOutput, Timer};
use super::stage::PowerStage;
use embedded_hal::digital::{ErrorType, OutputPin};
use servo::drivers::axis::{GuardedAxis, HardwareOf};
use servo::drivers::bridge::{self, HBridge};
use servo::drivers::encoder::Encoder;
use servo::drivers::gates::GateStatus;
use servo::drivers::interlock::InterlockLines;
use servo::drivers::parts::{Breaker, Parts};
use servo::drivers::sense::{CurrentSense, LowLegSense, Rises, SupplySense};
use servo::drivers::zero::ZeroLimits;

/// 1,024 readings: 0.1 s at 10 kHz.
const fn zero_limits(stage: &PowerStage) -> ZeroLimits {
    ZeroLimits { readings_log2: 10, window: stage.zero_window, spread: stage.zero_spread }
}

/// What the axes are made of.
pub struct Stm32Parts;

impl Parts for Stm32Parts {
    type Pwm = Compare;
    type Enable = EnableLine;
    type Counter = Quadrature;
    type Current = CurrentOf<Channel>;
    type Supply = Channel;
    type Input = Wire;
    type Breaker = Break;
}

/// The enable line of a power stage: a pin, or the timer's main output enable.
pub enum EnableLine {
    Pin(Wire),
    Main(MainOutput),
}

impl ErrorType for EnableLine {
    type Error = core::convert::Infallible;
}

impl OutputPin for EnableLine {
    fn set_low(&mut self) -> Result<(), Self::Error> {
        match self {
            EnableLine::Pin(wire) => wire.set_low(),
            EnableLine::Main(main) => main.set_low(),
        }
    }

    fn set_high(&mut self) -> Result<(), Self::Error> {
        match self {
            EnableLine::Pin(wire) => wire.set_high(),
            EnableLine::Main(main) => main.set_high(),
        }
    }
}

/// What switches bridges off.
pub enum Break {
    /// The break input of a timer.
    Timer {
        /// The timer.
        timer: Timer,
        /// Single-ended stages keep the main output enabled, an open bridge being two low lines; a discrete one enables it
        /// with the bridge.
        stays_enabled: bool,
    },
    /// The gate drivers of all axes, with their fault line.
    Gates(&'static GateStatus, Wire),
}

impl Breaker for Break {
    fn has_tripped(&self) -> bool {
        match self {
            Break::Timer { timer, .. } => timer.has_broken(),
            Break::Gates(status, fault) => status.is_off(!fault.level()),
        }
    }

    fn clear(&mut self) {
        match self {
            Break::Timer { timer, .. } => timer.clear_break(),
            Break::Gates(status, _) => status.all_open(),
        }
    }

    fn enable(&mut self) {
        if let Break::Timer { timer, stays_enabled: true } = self {
            timer.enable_outputs();
        }
    }

    fn measures(&self) -> bool {
        match self {
            Break::Gates(status, fault) if GATES.is_some() => status.measures(!fault.level()),
            _ => true,
        }
    }
}

/// The breakers of the first `N` axes: each timer, or the gate drivers of the board.
pub fn breakers<const N: usize>(board: &'static Board) -> impl Iterator<Item = Break> {
    let gates = GATES.map(|gates| Break::Gates(&gates::STATUS, Wire(gates.fault)));
    let stays_enabled = !board.stage.has_low_sides();
    let timers = pwm::timers::<N>(board).map(move |timer| Break::Timer { timer, stays_enabled });
    timers.filter(|_| GATES.is_none()).chain(gates)
}

/// A current sensor of this chip's converters.
pub trait FromBoard {
    /// Of the axis of this number.
    fn of(board: &Board, axis: usize) -> Self;
}

impl FromBoard for CurrentSense<Channel> {
    fn of(board: &Board, axis: usize) -> Self {
        let [channel, _] = Channel::currents(board, axis);
        CurrentSense::new(board.stage.current, zero_limits(board.stage), channel)
    }
}

impl FromBoard for LowLegSense<Channel> {
    fn of(board: &Board, axis: usize) -> Self {
        let rises = match board.axes[axis].current {
            Current::LowLegs(_, rises) => rises,
            Current::Sensor(_) => Rises::WithCurrentDown,
        };
        LowLegSense::new(zero_limits(board.stage), Channel::currents(board, axis), rises)
    }
}

/// The axis of this number, with its bridge open.
pub fn guarded(number: usize, board: &Board, full: u16) -> GuardedAxis<Stm32Parts> {
    let axis = &board.axes[number];
    let hardware = HardwareOf::<Stm32Parts> {
        bridge: power_stage(number, board, full),
        encoder: Encoder::new(Quadrature::of(axis.encoder)),
        current: FromBoard::of(board, number),
        supply: SupplySense::new(Some(Channel::supply())),
    };
    let lines = InterlockLines::new(Wire(axis.fault), Wire(board.enable));
    let breaker = if GATES.is_some() { 0 } else { axis.timer as usize };
    GuardedAxis::new(hardware, lines, axis.index.map(Wire), breaker)
}

/// The bridge of this axis, open, at this full scale.
pub fn power_stage(number: usize, board: &Board, full: u16) -> HBridge<Compare, Compare, EnableLine> {
    let (axis, stage) = (&board.axes[number], board.stage);
    let timer = Timer::of(axis.timer);
    let (a, b) = pwm::centres(stage);
    let [leg_a, leg_b] = axis.legs.map(usize::from);
    let config = bridge::Config {
        wiring: stage.wiring,
        decay: stage.decay,
        duty_limit: (u32::from(full) * u32::from(stage.duty_limit_permille) / 1000) as u16,
    };
    let enable = match stage.has_low_sides() {
        true => EnableLine::Main(MainOutput(timer)),
        false => EnableLine::Pin(Wire(axis.sleep)),
    };
    let lines = (timer.compare(leg_a, a, full), timer.compare(leg_b, b, full));
    match HBridge::new(config, lines.0, lines.1, enable) {
        Ok(bridge) => bridge,
        Err(_) => unreachable!("the lines of this board cannot refuse"),
    }
}
