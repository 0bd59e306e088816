//! STM32F405RG at 168 MHz. Register descriptions: reference manual RM0090; pins: [`pins`]; wiring: `docs/hardware.md`.
//!
//! ```text
//! TIM1 turning point ──trigger──> ADC1, ADC2 ──end of sequence──> control tick ──compare registers──> next turning point
//!                                 TIM2 … TIM5 count ──┘
//! ```
//!
//! One power stage an axis, all of one kind ([`stage`]); the axis is a value, their number is that of the image.

mod axis;
#[allow(dead_code, reason = "a board uses some of what boards may have")]
pub mod board;
#[allow(dead_code, reason = "a board uses some of what boards may have")]
#[cfg_attr(board = "odrive-v3", path = "boards/odrive.rs")]
#[cfg_attr(board = "odrive-v3-24v", path = "boards/odrive.rs")]
#[cfg_attr(board = "mks-odrive", path = "boards/odrive.rs")]
#[cfg_attr(board = "vesc-6", path = "boards/vesc.rs")]
#[cfg_attr(board = "stm32f405", path = "boards/own.rs")]
pub mod chosen;
mod clock;
mod converter;
mod counter;
mod delay;
mod drive;
pub mod flash;
mod gates;
mod gpio;
#[allow(dead_code, reason = "names and roles are for the tests and the documentation")]
pub mod pins;
mod pwm;
mod serial;
#[allow(dead_code, reason = "an image drives one of the power stages that the board knows")]
pub mod stage;
pub mod timing;
mod watchdog;

use super::{AXES, Board, Idle, Started};
use board::BOARD;
use flash::ChipFlash;
use gates::Supervised;
use servo::config::{Config, ConfigError, Field};
use servo::drivers::gates::Event;
use servo::drivers::scales::Scales;
use servo::link::protocol::{Refusal, ResetCause};
use servo::protect::Settings;
use stm32f4xx_hal::pac::{self, CorePeripherals, DBGMCU, Peripherals};
use watchdog::Watchdog;

use defmt_rtt as _;

pub use drive::{DriveOf, SETTLING};
pub use serial::SerialLine;

/// The board.
pub struct Stm32f405;

impl Board for Stm32f405 {
    const NAME: &'static str = BOARD.name;
    const MOST_AXES: usize = BOARD.most_axes();
    const SCALES: Scales = BOARD.scales();
    const PARAMETERS: u32 = flash::PARAMETERS;

    type Device = Peripherals;
    type Drive = DriveOf<AXES>;
    type Line = SerialLine;
    type Idle = Feeding;
    type Flash = ChipFlash;

    /// Starts clocks and cycle counter. Every pin is as after reset, and the watchdog does not run yet.
    fn begin(device: &Peripherals, core: &mut CorePeripherals) -> Started {
        let source = clock::start(&device.RCC, &device.FLASH, &device.DBGMCU, &device.TIM11);
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
            BOARD.stage.name,
            board::SCALE.supply_volt_per_lsb(BOARD.supply.divider),
            board::SCALE.ampere_per_lsb(BOARD.stage.volt_per_ampere)
        );
        let brown_out_reset_off = clock::is_brown_out_reset_off(&device.FLASH);
        if brown_out_reset_off {
            defmt::warn!("the brown-out reset is off: set the option bytes to 2.7 V");
        }
        Started { cause, clock: source.into(), brown_out_reset_off }
    }

    fn flash() -> ChipFlash {
        ChipFlash::new()
    }

    /// Sets up pins, timers, converters, link and watchdog.
    fn init(device: Peripherals, _core: CorePeripherals) -> (DriveOf<AXES>, SerialLine, Feeding) {
        set_up(device, &BOARD, SETTLING)
    }

    /// Refuses what the timer cannot make, and scales of other boards: the control rate must divide the PWM frequency, a duty acts one tick later, and
    /// the currents of all axes are measured within half a PWM period.
    fn supports(config: &Config, protection: Option<&Settings>) -> Result<(), Refusal> {
        let shortest = timing::least_full_scale(BOARD.currents(AXES).len() as u8);
        if config.pwm_full_scale < shortest {
            let (minimum, maximum) = (f32::from(shortest), f32::from(i16::MAX));
            return Err(ConfigError { field: Field::PwmFullScale, minimum, maximum }.into());
        }
        let periods = timing::periods_per_tick(config.pwm_full_scale, config.tick_hz);
        if periods.is_none() || config.pwm_delay_ticks != 1 {
            return Err(Refusal::TickRate);
        }
        // With the board's scale, or one that is calibrated from it, the reach is one in true volts and amperes.
        Self::SCALES.allow(config)?;
        Ok(BOARD.reach().allows(config, protection)?)
    }

    fn bridge_off() {
        drive::switch_off::<AXES>(&BOARD);
    }

    /// The bridge stays off, the log can be read, and the watchdog ends it.
    fn halt() -> ! {
        loop {
            cortex_m::asm::nop();
        }
    }
}

/// Everything but the clocks, for `N` axes with power stages of one kind. Order: safe lines first, outputs last, the
/// timer that sets all in motion at the very end. No bridge is driven in the first `settling` ticks.
pub fn set_up<const N: usize>(
    device: Peripherals,
    board: &'static board::Board,
    settling: u8,
) -> (DriveOf<N>, SerialLine, Feeding) {
    clock::enable_peripherals(&device.RCC, board);
    stop_with_debugger(&device.DBGMCU);
    let drive = DriveOf::prepare(&device.ADC_COMMON, device.ADC1, &device.ADC2, board, settling);
    let line = SerialLine::start(board.link, device.DMA1);
    let gates = Supervised::start(tell);
    let idle = Feeding { watchdog: Watchdog::start(device.IWDG), gates };
    drive.go();
    (drive, line, idle)
}

/// A halted processor must neither be reset by the watchdog nor leave a bridge driven: with its timer stopped the
/// outputs are switched off (RM0090 section 38.16.4).
fn stop_with_debugger(debug: &DBGMCU) {
    debug.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    debug.apb2_fz().modify(|_, w| w.dbg_tim1_stop().set_bit().dbg_tim8_stop().set_bit());
}

/// Feeds the watchdog while control ticks come, and looks after gate drivers.
pub struct Feeding {
    watchdog: Watchdog,
    gates: Supervised,
}

/// Into the log and for the link, from idle alone.
fn tell(event: Event) {
    gates::note(&event);
    match event {
        Event::Started => defmt::info!("gate drivers: set up and read back"),
        Event::NotStarted(number, trouble) => {
            let (text, word) = trouble.words();
            defmt::warn!("gate driver {=usize} does not start: {=str}, {=u16:#x}", number, text, word);
        }
        Event::Fault(number, trouble) => {
            let (text, word) = trouble.words();
            defmt::warn!("gate driver {=usize}: {=str}, {=u16:#x}", number, text, word);
        }
    }
}

impl Idle for Feeding {
    fn turn(&mut self) {
        self.watchdog.turn();
        self.gates.turn().into_iter().for_each(tell);
    }

    fn while_storing<R>(&mut self, work: impl FnOnce() -> R) -> R {
        self.watchdog.while_erasing(work)
    }
}
