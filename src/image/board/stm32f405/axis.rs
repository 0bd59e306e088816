//! One axis of this board: its drivers, and what the enable contact and the fault line permit.

use super::converter::Channel;
use super::counter::Quadrature;
use super::gpio::Wire;
use super::pins::{Pin, Port};
use super::pwm::{self, Compare, MainOutput, Timer};
use super::stage::PowerStage;
use embedded_hal::digital::{ErrorType, OutputPin};
use servo::axis::{Bridge, Sample};
use servo::drivers::bridge::{self, HBridge};
use servo::drivers::encoder::Encoder;
use servo::drivers::hardware::AxisHardware;
use servo::drivers::interlock::{Interlock, InterlockLines};
use servo::drivers::sense::{CurrentSense, SupplySense};
use servo::drivers::zero::ZeroLimits;

/// Sleep or enable pins of the four axes, as in [`super::pins::LINES`].
pub const SLEEP: [Wire; 4] =
    [Wire(Pin(Port::B, 0)), Wire(Pin(Port::B, 1)), Wire(Pin(Port::B, 10)), Wire(Pin(Port::B, 11))];
/// Fault pin of axes 0 and 1, of axes 2 and 3.
const FAULT: [Wire; 2] = [Wire(Pin(Port::B, 12)), Wire(Pin(Port::A, 6))];
const ENABLE: Wire = Wire(Pin(Port::C, 10));

/// 1,024 readings: 0.1 s at 10 kHz. A spread of 40 counts is several times the converter's noise (DS8626: ±2 counts) and
/// less than one ampere on every stage.
const fn zero_limits(stage: &PowerStage) -> ZeroLimits {
    ZeroLimits { readings_log2: 10, window: stage.zero_window, spread: 40 }
}

fn timer_of(axis: usize) -> Timer {
    if axis < 2 { Timer::one() } else { Timer::eight() }
}

/// The enable line of a power stage: a pin, or the timer's main output enable.
enum EnableLine {
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

/// One axis with its permission lines.
pub struct AxisOfBoard {
    hardware: AxisHardware<Compare, Compare, EnableLine, Quadrature, Channel, Channel>,
    interlock: InterlockLines<Wire, Wire>,
    timer: Timer,
    stage: &'static PowerStage,
    /// What the lines say in this tick.
    permission: Interlock,
    /// Anything but granted lasts until the axis itself has opened the bridge.
    verdict: Interlock,
}

impl AxisOfBoard {
    /// The axis of this number, with its bridge open.
    pub fn new(axis: usize, stage: &'static PowerStage, full: u16) -> Self {
        Self {
            hardware: AxisHardware {
                bridge: power_stage(axis, stage, full),
                encoder: Encoder::new(Quadrature::of_axis(axis)),
                current: CurrentSense::new(stage.current, zero_limits(stage), Channel::current(axis)),
                supply: SupplySense::new(Some(Channel::supply())),
            },
            interlock: InterlockLines::new(FAULT[axis / 2], ENABLE),
            timer: timer_of(axis),
            stage,
            permission: Interlock::Granted,
            verdict: Interlock::Disabled,
        }
    }

    /// Takes over a full scale, which needs new lines. The converter stays as it is, and so does the zero of the current sensor.
    pub fn rescale(&mut self, axis: usize, full: u16) {
        self.hardware.bridge = power_stage(axis, self.stage, full);
    }

    /// What the lines said when they were last looked at.
    pub fn permission(&self) -> Interlock {
        self.permission
    }

    /// Reads counter and converters.
    pub fn sample(&mut self) -> Sample {
        self.hardware.sample()
    }

    /// Looks at the lines. A break that was too short for the pin to be seen low is still a fault.
    pub fn judge(&mut self) {
        self.permission = match self.interlock.read() {
            Interlock::Granted if self.timer.has_broken() => Interlock::BridgeFault,
            verdict => verdict,
        };
        if self.permission != Interlock::Granted {
            self.verdict = self.permission;
        }
    }

    /// Without permission the bridge opens whatever the axis wants, and stays open until the axis wants it open too.
    pub fn apply(&mut self, wanted: Bridge, duty: i16) {
        if wanted == Bridge::Open {
            self.rearm();
        }
        // A break since the tick began must not be undone by enabling the outputs again.
        let allowed = self.verdict == Interlock::Granted && !self.timer.has_broken();
        let bridge = if allowed { wanted } else { Bridge::Open };
        // The lines of this board cannot refuse.
        let _ = self.hardware.apply(bridge, duty);
    }

    /// Single-ended stages keep the main output enabled, an open bridge being two low lines; a discrete one enables it
    /// with the bridge.
    fn rearm(&mut self) {
        if self.timer.has_broken() {
            self.timer.clear_break();
        }
        if !self.stage.has_low_sides() {
            self.timer.enable_outputs();
        }
        self.verdict = Interlock::Granted;
    }
}

fn power_stage(axis: usize, stage: &PowerStage, full: u16) -> HBridge<Compare, Compare, EnableLine> {
    let timer = timer_of(axis);
    let (a, b) = pwm::centres(stage);
    let first = 2 * (axis % 2);
    let config = bridge::Config {
        wiring: stage.wiring,
        decay: stage.decay,
        duty_limit: (u32::from(full) * u32::from(stage.duty_limit_permille) / 1000) as u16,
    };
    let enable = match stage.has_low_sides() {
        true => EnableLine::Main(MainOutput(timer)),
        false => EnableLine::Pin(SLEEP[axis]),
    };
    let lines = (timer.compare(first, a, full), timer.compare(first + 1, b, full));
    match HBridge::new(config, lines.0, lines.1, enable) {
        Ok(bridge) => bridge,
        Err(_) => unreachable!("the lines of this board cannot refuse"),
    }
}
