//! What the image asks of a board.
//!
//! A board hands out four parts, each to the one task that uses it: [`Drive`] to the control interrupt, [`Line`] to the
//! link, [`Idle`] to the loop below all interrupts, and the flash to the store of parameters.

use cortex_m::Peripherals as CorePeripherals;
use embedded_storage::nor_flash::NorFlash;
use servo::axis::{Bridge, Sample};
use servo::config::Config;
use servo::drivers::scales::Scales;
use servo::link::board::{Clock, Gates};
use servo::link::protocol::{Refusal, ResetCause};
use servo::protect::{Interlock, Settings};

/// What a start has found.
#[derive(Clone, Copy)]
pub struct Started {
    /// Why the chip has started.
    pub cause: ResetCause,
    /// What its clocks come from.
    pub clock: Clock,
    /// It is not held in reset while its supply is too low.
    pub brown_out_reset_off: bool,
}

/// A board: a chip and what is wired to it, or a program that plays both.
pub trait Board {
    /// Name of the board in the log.
    const NAME: &'static str;
    /// Axes that the board can drive.
    const MOST_AXES: usize;
    /// What one count of its converters is worth.
    const SCALES: Scales;
    /// Where the stored parameters begin: bytes from the start of the flash.
    const PARAMETERS: u32;

    /// The peripherals of the chip.
    type Device;
    /// The part of the control interrupt.
    type Drive: Drive;
    /// The part of the link.
    type Line: Line;
    /// The part of the loop below all interrupts.
    type Idle: Idle;
    /// The flash of the stored parameters.
    type Flash: NorFlash;

    /// Starts the clocks and tells how the chip has started.
    fn begin(device: &Self::Device, core: &mut CorePeripherals) -> Started;

    /// Takes the flash. The clocks run already.
    fn flash() -> Self::Flash;

    /// Sets pins and timers up. When it returns the bridges are open, and control ticks begin.
    fn init(device: Self::Device, core: CorePeripherals) -> (Self::Drive, Self::Line, Self::Idle);

    /// Refuses a configuration that the timers cannot carry out or whose scales are not the board's, and limits beyond what the converters can tell: they would
    /// never act. `protection`: what comes along with the configuration, if anything does.
    fn supports(config: &Config, protection: Option<&Settings>) -> Result<(), Refusal>;

    /// Switches every bridge off. It may be called from any context, even from the handler of a fault, and needs no state.
    fn bridge_off();

    /// Ends the program after a fault.
    fn halt() -> !;
}

/// Sensors in, bridges out. Owned by the control interrupt.
pub trait Drive {
    /// Begins a tick: acknowledges the interrupt, and reads counts, index lines, converters and permission lines of all
    /// axes. This moment counts for every axis, however long those before it compute.
    fn begin_tick(&mut self);

    /// Count and converters of an axis, as they were when the tick began.
    fn sample(&self, axis: usize) -> Sample;

    /// What the enable contact and the fault line said when the tick began.
    fn interlock(&self, axis: usize) -> Interlock;

    /// True if the index pulse of the axis' encoder was there when its count was read.
    fn index(&self, axis: usize) -> bool;

    /// Sets the bridge of an axis as the axis wants it, if its lines permit.
    fn apply(&mut self, axis: usize, bridge: Bridge, duty: i16);

    /// Ends a tick. True: the next one is due already, so this tick took more than its period.
    fn end_tick(&mut self) -> bool;

    /// Zeros of the current of an axis, counts or marks of [`Sample`].
    fn zeros(&self, axis: usize) -> [i16; 2];

    /// How the gate drivers are, if the board sets some up.
    fn gates(&self) -> Option<Gates>;

    /// Can the counter of this axis go round unseen while the processor stands still for seconds?
    fn goes_round(&self, axis: usize) -> bool;

    /// Takes over PWM scale and control rate of an axis. [`Board::supports`] has agreed to them, and every other axis that
    /// is configured has the same.
    fn configure(&mut self, axis: usize, config: &Config);

    /// Starts the chip anew, with every bridge open.
    fn restart(&mut self);

    /// Reads the clock that measures the cost of a tick. It wraps.
    fn clock(&self) -> u32;

    /// Clocks since `start`, modulo the width of the clock.
    fn clock_since(&self, start: u32) -> u32;
}

/// The bytes of the link. Owned by the link task.
pub trait Line {
    /// Takes the next byte from the host.
    fn read(&mut self) -> Option<u8>;

    /// Bytes that [`Line::write`] has room for.
    fn room(&mut self) -> usize;

    /// Sends bytes. What does not fit is lost.
    fn write(&mut self, bytes: &[u8]);
}

/// The board's own business below all interrupts.
pub trait Idle {
    /// Does one turn of it. Called for ever.
    fn turn(&mut self);

    /// Runs work that may stall the processor for seconds: an erase of the flash.
    fn while_storing<R>(&mut self, work: impl FnOnce() -> R) -> R;
}
