//! STM32F405RG at 168 MHz. Register descriptions: reference manual RM0090; pins: [`pins`]; wiring: `docs/hardware.md`.
//!
//! ```text
//! TIM1 turning point ──trigger──> ADC1, ADC2 ──end of sequence──> control tick ──compare registers──> next turning point
//!                                 TIM2 … TIM5 count ──┘
//! ```
//!
//! One power stage an axis, all of one kind ([`stage`]); the axis is a value, their number is [`AXES`].

mod clock;
mod converter;
mod counter;
pub mod flash;
mod gpio;
#[allow(dead_code, reason = "names and roles are for the tests and the documentation")]
pub mod pins;
mod pwm;
mod serial;
#[allow(
    dead_code,
    reason = "an image drives one of the power stages that the board knows"
)]
pub mod stage;
pub mod timing;
mod watchdog;

use cortex_m::peripheral::DWT;
use servo::axis::{Bridge, Output, Sample};
use servo::config::Config;
use servo::drivers::bridge::{self, HBridge};
use servo::drivers::encoder::Encoder;
use servo::drivers::hardware::AxisHardware;
use servo::drivers::permit::{Permit, PermitLines};
use servo::drivers::sense::{CurrentSense, SupplySense};
use servo::drivers::zero::ZeroLimits;
use servo::link::protocol::{Refusal, ResetCause};
use stm32f4xx_hal::pac::{ADC1, CorePeripherals, DBGMCU, Peripherals};

use converter::Channel;
use counter::Quadrature;
use embedded_hal::digital::{ErrorType, OutputPin};
use flash::ChipFlash;
use gpio::Wire;
use pins::{Pin, Port};
use pwm::{Compare, MainOutput, Timer};
use stage::{ACTIVE, PowerStage};
use watchdog::Watchdog;

use defmt_rtt as _;

pub use flash::{ChipFlash as Flash, PARAMETERS};
pub use serial::Line;

/// For the log.
pub const NAME: &str = "STM32F405";
/// Number of axes that this image drives, 1 … 4.
pub const AXES: usize = match () {
    () if cfg!(feature = "four-axes") => 4,
    () if cfg!(feature = "two-axes") => 2,
    () => 1,
};
const _: () = assert!(AXES >= 1 && AXES <= 4, "the chip has room for four axes");
const _: () = assert!(
    !ACTIVE.has_low_sides() || AXES == 1,
    "a discrete bridge takes the whole of TIM1"
);

/// The control interrupt's side of this image.
pub type Drive = DriveOf<AXES>;

/// Sleep or enable pins of the four axes, as in [`pins::LINES`].
const SLEEP: [Wire; 4] = [
    Wire(Pin(Port::B, 0)),
    Wire(Pin(Port::B, 1)),
    Wire(Pin(Port::B, 10)),
    Wire(Pin(Port::B, 11)),
];
/// Fault pin of axes 0 and 1, of axes 2 and 3.
const FAULT: [Wire; 2] = [Wire(Pin(Port::B, 12)), Wire(Pin(Port::A, 6))];
const ENABLE: Wire = Wire(Pin(Port::C, 10));
const TICK: Wire = Wire(Pin(Port::C, 12));

/// Index lines of the four axes, as in [`pins::LINES`].
const INDEX: [Wire; 4] = [
    Wire(Pin(Port::B, 8)),
    Wire(Pin(Port::B, 9)),
    Wire(Pin(Port::C, 11)),
    Wire(Pin(Port::B, 15)),
];

/// Two looks at the phase, each with a tick for its correction.
const ALIGNING: u8 = 4;
/// 3 ms at the rate of power-up: a driver wakes within 1 ms (DRV8874 data sheet) and may report that as a fault, and fault
/// lines rise. The bridge cannot be driven yet: nothing is configured.
const SETTLING: u8 = 30;

/// 1,024 readings: 0.1 s at 10 kHz. A spread of 40 counts is several times the converter's noise (DS8626: ±2 counts) and
/// less than one ampere on every stage.
const fn zero_limits(stage: &PowerStage) -> ZeroLimits {
    ZeroLimits {
        readings_log2: 10,
        window: stage.zero_window,
        spread: 40,
    }
}

/// Clocks and cycle counter; every pin is as after reset, and the watchdog does not run yet.
pub fn begin(device: &Peripherals, core: &mut CorePeripherals) -> ResetCause {
    let source = clock::start(&device.RCC, &device.FLASH);
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let cause = clock::take_reset_cause(&device.RCC);
    defmt::info!(
        "started by {=str}, clock from {}, power stage {=str}, one count is {=f32} V of supply, {=f32} A",
        match cause {
            ResetCause::Power => "Power",
            ResetCause::Pin => "Pin",
            ResetCause::Software => "Software",
            ResetCause::Watchdog => "Watchdog",
        },
        source,
        ACTIVE.name,
        stage::SCALE.supply_volt_per_lsb(stage::SUPPLY_DIVIDER),
        stage::SCALE.ampere_per_lsb(ACTIVE.volt_per_ampere)
    );
    cause
}

/// The flash of the stored parameters.
pub fn flash() -> ChipFlash {
    ChipFlash::new()
}

/// Pins, timers, converters, link, watchdog; the bridges are open when it returns, and control ticks begin.
pub fn init(device: Peripherals, _core: CorePeripherals) -> (Drive, Line, Idle) {
    set_up(device, &ACTIVE)
}

/// Everything but the clocks, for `N` axes with power stages of one kind. Order: safe lines first, outputs last, the
/// timer that sets all in motion at the very end.
pub fn set_up<const N: usize>(device: Peripherals, stage: &'static PowerStage) -> (DriveOf<N>, Line, Idle) {
    clock::enable_peripherals(&device.RCC);
    stop_with_debugger(&device.DBGMCU);
    SLEEP[..N].iter().for_each(|wire| wire.drive(false));
    for timer in timers::<N>() {
        timer.set_up(stage, timing::START_FULL_SCALE, timing::START_PERIODS);
    }
    gpio::set_up(N, stage.has_low_sides());
    (0..N).for_each(|axis| Quadrature::of_axis(axis).start());
    converter::start(&device.ADC_COMMON, &device.ADC1, &device.ADC2, N as u8);
    let line = Line::start(device.USART2, device.DMA1);
    let drive = DriveOf::new(device.ADC1, stage);
    let idle = Idle {
        watchdog: Watchdog::start(device.IWDG),
    };
    if !stage.has_low_sides() {
        timers::<N>().for_each(Timer::enable_outputs);
    }
    timers::<N>().for_each(Timer::start);
    (drive, line, idle)
}

/// A halted processor must neither be reset by the watchdog nor leave a bridge driven: with its timer stopped the
/// outputs are switched off (RM0090 section 38.16.4).
fn stop_with_debugger(debug: &DBGMCU) {
    debug.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    debug
        .apb2_fz()
        .modify(|_, w| w.dbg_tim1_stop().set_bit().dbg_tim8_stop().set_bit());
}

/// TIM1, and TIM8 for the third and fourth axis. They start a few clocks apart; only TIM1 paces and triggers.
fn timers<const N: usize>() -> impl Iterator<Item = Timer> {
    [Timer::one(), Timer::eight()].into_iter().take(N.div_ceil(2))
}

fn timer_of(axis: usize) -> Timer {
    if axis < 2 { Timer::one() } else { Timer::eight() }
}

/// Refuses what the timer cannot make: the control rate must divide the PWM frequency, and a duty acts one tick later.
pub fn supports(config: &Config) -> Result<(), Refusal> {
    let periods = timing::periods_per_tick(config.pwm_full_scale, config.tick_hz);
    let possible = periods.is_some() && config.pwm_delay_ticks == 1;
    possible.then_some(()).ok_or(Refusal::TickRate)
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
struct AxisOfBoard {
    hardware: AxisHardware<Compare, Compare, EnableLine, Quadrature, Channel, Channel>,
    permit: PermitLines<Wire, Wire>,
    timer: Timer,
    stage: &'static PowerStage,
    /// The lines in this tick.
    permission: Permit,
    /// Anything but granted lasts until the axis itself has opened the bridge.
    verdict: Permit,
}

impl AxisOfBoard {
    fn new(axis: usize, stage: &'static PowerStage, full: u16) -> Self {
        Self {
            hardware: AxisHardware {
                bridge: power_stage(axis, stage, full),
                encoder: Encoder::new(Quadrature::of_axis(axis)),
                current: CurrentSense::new(stage.current, zero_limits(stage), Channel::current(axis)),
                supply: SupplySense::new(Some(Channel::supply())),
            },
            permit: PermitLines::new(FAULT[axis / 2], ENABLE),
            timer: timer_of(axis),
            stage,
            permission: Permit::Granted,
            verdict: Permit::Disabled,
        }
    }

    /// A new full scale needs new lines. The converter stays as it is, and so does the zero of the current sensor.
    fn rescale(&mut self, axis: usize, full: u16) {
        self.hardware.bridge = power_stage(axis, self.stage, full);
    }

    /// A break that was too short for the pin to be seen low is still a fault.
    fn judge(&mut self) {
        self.permission = match self.permit.read() {
            Permit::Granted if self.timer.has_broken() => Permit::BridgeFault,
            verdict => verdict,
        };
        if self.permission != Permit::Granted {
            self.verdict = self.permission;
        }
    }

    /// Without permission the bridge opens whatever the axis wants, and stays open until the axis wants it open too.
    fn apply(&mut self, wanted: Bridge, duty: i16) {
        if wanted == Bridge::Open {
            self.rearm();
        }
        // A break since the tick began must not be undone by enabling the outputs again.
        let allowed = self.verdict == Permit::Granted && !self.timer.has_broken();
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
        self.verdict = Permit::Granted;
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

/// Owned by the control interrupt: sensors in, bridges out.
pub struct DriveOf<const N: usize> {
    axes: [AxisOfBoard; N],
    converter: ADC1,
    /// Ticks in which the phase of the update is still checked.
    aligning: u8,
    /// Ticks in which faults of the bridge are those of waking up.
    settling: u8,
    periods: u8,
    full: u16,
}

impl<const N: usize> DriveOf<N> {
    fn new(converter: ADC1, stage: &'static PowerStage) -> Self {
        let (full, periods) = (timing::START_FULL_SCALE, timing::START_PERIODS);
        let axes = core::array::from_fn(|axis| AxisOfBoard::new(axis, stage, full));
        Self {
            axes,
            converter,
            aligning: ALIGNING,
            settling: SETTLING,
            periods,
            full,
        }
    }

    /// Begins the tick: acknowledges the interrupt.
    pub fn begin_tick(&mut self) {
        TICK.drive(true);
        converter::clear_end(&self.converter);
        self.align();
        self.settle();
    }

    /// Reads every sensor of one axis.
    pub fn sample(&mut self, axis: usize) -> Sample {
        if self.settling == 0 {
            self.axes[axis].judge();
        }
        self.axes[axis].hardware.sample()
    }

    /// What the lines of one axis said when it was sampled.
    pub fn permit(&self, axis: usize) -> Permit {
        self.axes[axis].permission
    }

    /// Is the index pulse of an axis' encoder there? To be asked next to [`Self::sample`], which reads the count.
    pub fn index(&self, axis: usize) -> bool {
        INDEX[axis].level()
    }

    /// Sets one axis' bridge as the axis wants it, if its lines permit.
    pub fn apply(&mut self, axis: usize, output: &Output) {
        self.set(axis, output.bridge, output.duty);
    }

    /// Tells the watchdog and the oscilloscope. True: the next measurement has already ended, so this tick took more
    /// than its period.
    pub fn end_tick(&mut self) -> bool {
        watchdog::control_has_run();
        TICK.drive(false);
        converter::has_ended(&self.converter)
    }

    /// Sets one axis' bridge.
    pub fn set(&mut self, axis: usize, bridge: Bridge, duty: i16) {
        self.axes[axis].apply(bridge, duty);
    }

    /// Takes over PWM scale and control rate of an axis; [`supports`] has agreed to them, and every other axis that is
    /// configured has the same. All are rescaled when they are new; else the other axes may be driven and are left alone.
    pub fn configure(&mut self, axis: usize, config: &Config) {
        let Some(periods) = timing::periods_per_tick(config.pwm_full_scale, config.tick_hz) else {
            return;
        };
        if (self.full, self.periods) == (config.pwm_full_scale, periods) {
            if let Some(own) = self.axes.get_mut(axis) {
                own.rescale(axis, self.full);
            }
            return;
        }
        (self.full, self.periods) = (config.pwm_full_scale, periods);
        for timer in timers::<N>() {
            timer.set_period(self.full, periods);
        }
        for (number, axis) in self.axes.iter_mut().enumerate() {
            axis.rescale(number, self.full);
        }
        self.aligning = ALIGNING;
    }

    /// Updates belong at the upper turning point. Whether an odd repetition count lands there or at the lower one
    /// depends on its phase against the counter, about which the reference manuals of this timer disagree; so the first
    /// ticks look, and one interval shorter by half a period corrects it.
    fn align(&mut self) {
        let Some(left) = self.aligning.checked_sub(1) else {
            return;
        };
        self.aligning = left;
        let slip = left % 2 == 1 && !Timer::one().runs_down();
        for timer in timers::<N>() {
            timer.set_repetitions(timing::repetitions(self.periods).saturating_sub(u8::from(slip)));
        }
    }

    /// The break flag of power-up, when the fault line was still rising, is forgotten.
    fn settle(&mut self) {
        if let Some(left) = self.settling.checked_sub(1) {
            self.settling = left;
            timers::<N>().for_each(Timer::clear_break);
        }
    }

    /// Core clocks since the start of the counter, wraps.
    pub fn clock(&self) -> u32 {
        DWT::cycle_count()
    }

    /// Core clocks since `start`.
    pub fn clock_since(&self, start: u32) -> u32 {
        self.clock().wrapping_sub(start)
    }
}

/// What is done below all interrupts.
pub struct Idle {
    watchdog: Watchdog,
}

impl Idle {
    /// Feeds the watchdog while control ticks come.
    pub fn turn(&mut self) {
        self.watchdog.turn();
    }

    /// Runs what may stall the processor for seconds: an erase.
    pub fn while_storing<R>(&mut self, work: impl FnOnce() -> R) -> R {
        self.watchdog.while_erasing(work)
    }
}

/// Every bridge off by the shortest way, from any context, even a fault: outputs held low by the timers, drivers put to
/// sleep. Two registers and one pin an axis; no state of the program is needed.
pub fn bridge_off() {
    timers::<AXES>().for_each(Timer::disable_outputs);
    SLEEP[..AXES].iter().for_each(|wire| wire.drive(false));
}

/// After a fault: the bridge stays off, the log can be read, and the watchdog ends it.
pub fn halt() -> ! {
    loop {
        cortex_m::asm::nop();
    }
}
