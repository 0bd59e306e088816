//! STM32F405RG at 168 MHz. Register descriptions: reference manual RM0090; pins: [`pins`]; wiring: `docs/hardware.md`.
//!
//! ```text
//! TIM1 turning point ──trigger──> ADC1, ADC2 ──end of sequence──> control tick ──compare registers──> next turning point
//!                                 TIM2 … TIM5 count ──┘
//! ```
//!
//! One power stage an axis, all of one kind ([`stage`]); the axis is a value, their number is that of the image.

mod axis;
mod clock;
mod converter;
mod counter;
mod drive;
pub mod flash;
mod gpio;
#[allow(dead_code, reason = "names and roles are for the tests and the documentation")]
pub mod pins;
mod pwm;
mod serial;
#[allow(dead_code, reason = "an image drives one of the power stages that the board knows")]
pub mod stage;
pub mod timing;
mod watchdog;

use super::{AXES, Board, Idle};
use axis::SLEEP;
use counter::Quadrature;
use flash::ChipFlash;
use pwm::Timer;
use servo::config::Config;
use servo::link::protocol::{Refusal, ResetCause};
use stage::{ACTIVE, PowerStage};
use stm32f4xx_hal::pac::{CorePeripherals, DBGMCU, Peripherals};
use watchdog::Watchdog;

use defmt_rtt as _;

pub use drive::DriveOf;
pub use serial::SerialLine;

const _: () = assert!(!ACTIVE.has_low_sides() || AXES == 1, "a discrete bridge takes the whole of TIM1");

/// The board.
pub struct Stm32f405;

impl Board for Stm32f405 {
    const NAME: &'static str = "STM32F405";
    /// Two timers make PWM, each for two axes.
    const MOST_AXES: usize = 4;
    const PARAMETERS: u32 = flash::PARAMETERS;

    type Device = Peripherals;
    type Drive = DriveOf<AXES>;
    type Line = SerialLine;
    type Idle = Feeding;
    type Flash = ChipFlash;

    /// Starts clocks and cycle counter. Every pin is as after reset, and the watchdog does not run yet.
    fn begin(device: &Peripherals, core: &mut CorePeripherals) -> ResetCause {
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

    fn flash() -> ChipFlash {
        ChipFlash::new()
    }

    /// Sets up pins, timers, converters, link and watchdog.
    fn init(device: Peripherals, _core: CorePeripherals) -> (DriveOf<AXES>, SerialLine, Feeding) {
        set_up(device, &ACTIVE)
    }

    /// Refuses what the timer cannot make: the control rate must divide the PWM frequency, and a duty acts one tick later.
    fn supports(config: &Config) -> Result<(), Refusal> {
        let periods = timing::periods_per_tick(config.pwm_full_scale, config.tick_hz);
        let possible = periods.is_some() && config.pwm_delay_ticks == 1;
        possible.then_some(()).ok_or(Refusal::TickRate)
    }

    /// Takes the shortest way: outputs held low by the timers, drivers put to sleep. Two registers and one pin an axis.
    fn bridge_off() {
        timers::<AXES>().for_each(Timer::disable_outputs);
        SLEEP[..AXES].iter().for_each(|wire| wire.drive(false));
    }

    /// The bridge stays off, the log can be read, and the watchdog ends it.
    fn halt() -> ! {
        loop {
            cortex_m::asm::nop();
        }
    }
}

/// Everything but the clocks, for `N` axes with power stages of one kind. Order: safe lines first, outputs last, the
/// timer that sets all in motion at the very end.
pub fn set_up<const N: usize>(
    device: Peripherals,
    stage: &'static PowerStage,
) -> (DriveOf<N>, SerialLine, Feeding) {
    clock::enable_peripherals(&device.RCC);
    stop_with_debugger(&device.DBGMCU);
    SLEEP[..N].iter().for_each(|wire| wire.drive(false));
    for timer in timers::<N>() {
        timer.set_up(stage, timing::START_FULL_SCALE, timing::START_PERIODS);
    }
    gpio::set_up(N, stage.has_low_sides());
    (0..N).for_each(|axis| Quadrature::of_axis(axis).start());
    converter::start(&device.ADC_COMMON, &device.ADC1, &device.ADC2, N as u8);
    let line = SerialLine::start(device.USART2, device.DMA1);
    let drive = DriveOf::new(device.ADC1, stage);
    let idle = Feeding { watchdog: Watchdog::start(device.IWDG) };
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
    debug.apb2_fz().modify(|_, w| w.dbg_tim1_stop().set_bit().dbg_tim8_stop().set_bit());
}

/// TIM1, and TIM8 for the third and fourth axis. They start a few clocks apart; only TIM1 paces and triggers.
fn timers<const N: usize>() -> impl Iterator<Item = Timer> {
    [Timer::one(), Timer::eight()].into_iter().take(N.div_ceil(2))
}

/// Feeds the watchdog while control ticks come.
pub struct Feeding {
    watchdog: Watchdog,
}

impl Idle for Feeding {
    fn turn(&mut self) {
        self.watchdog.turn();
    }

    fn while_storing<R>(&mut self, work: impl FnOnce() -> R) -> R {
        self.watchdog.while_erasing(work)
    }
}
