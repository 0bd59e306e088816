//! TIM1 and TIM8: centre-aligned PWM, the pace of the control tick, and the bridge's emergency exit.
//!
//! The counter runs 0 → F → 0 at 168 MHz; a PWM period is 2 F clocks. Compare values, reload value and repetitions are
//! preloaded and take effect together at an update, once per control tick, at the upper turning point: a duty computed
//! in tick k acts from tick k + 1 on. The part of the period in which the bridge drives is centred on that same point,
//! so a current sampled there is the mean of its ripple.
//!
//! The break input (driver fault, low) clears the main output enable in hardware, without a clock or a program; only
//! software sets it again. While it is clear the outputs are held low.

use super::board::{Board, FaultLine, PwmTimer};
use super::pac::tim1::{RegisterBlock, ccmr1_output::OC1M};
use super::pac::{TIM1, TIM8};
use super::stage::{Outputs, PowerStage};
use super::timing;
use core::convert::Infallible;
use embedded_hal::digital::{self, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use servo::drivers::bridge::{Decay, Wiring};

/// Which end of the count the high part of a line is centred on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Centre {
    /// PWM mode 1: high while the count is below the compare value, centred on 0.
    Bottom,
    /// PWM mode 2: high from the compare value on, centred on F.
    Top,
}

/// Lines a and b such that the driven part of the period is centred on the upper turning point.
pub const fn centres(stage: &PowerStage) -> (Centre, Centre) {
    match (stage.decay, stage.wiring) {
        // One line is always high, the other one's *low* part drives.
        (Decay::Slow, Wiring::TwoInputs) => (Centre::Bottom, Centre::Bottom),
        // One line is always low, the other one's high part drives.
        (Decay::Slow, Wiring::HalfBridges) => (Centre::Top, Centre::Top),
        // b is the complement of a.
        (Decay::LockedAntiPhase, _) => (Centre::Top, Centre::Bottom),
    }
}

/// One of the two PWM timers.
#[derive(Clone, Copy)]
pub struct Timer(&'static RegisterBlock);

// SAFETY: registers lie at a fixed address for every context, and a device access needs no thread. Set-up hands each value
// to the one task that uses it.
unsafe impl Send for Timer {}

impl Timer {
    /// The timer of this name.
    pub fn of(timer: PwmTimer) -> Self {
        let address = match timer {
            PwmTimer::One => TIM1::ptr(),
            PwmTimer::Eight => TIM8::ptr(),
        };
        // SAFETY: valid for the life of the program; every access through it is a register access.
        Self(unsafe { &*address })
    }

    /// Everything but the start, for the first `axes` axes of a board: outputs enabled but held low until
    /// [`Timer::enable_outputs`].
    pub fn set_up(self, timer: PwmTimer, board: &Board, axes: usize, full: u16, periods: u8) {
        self.count_up_and_down();
        self.set_period(full, periods);
        self.set_channels(timer, board, axes, full);
        self.set_break(board);
        // Loads the preload registers.
        self.0.egr().write(|w| w.ug().set_bit());
    }

    /// CMS 01: centre-aligned; the choice among the three centre-aligned modes concerns compare flags that nobody uses.
    /// MMS 010: the update is the trigger output, which starts the converters.
    fn count_up_and_down(self) {
        self.0.cr1().write(|w| w.cms().center_aligned1().arpe().set_bit());
        self.0.cr2().write(|w| w.mms().update());
    }

    /// Reload value and repetitions; both act from the next update on.
    pub fn set_period(self, full: u16, periods: u8) {
        self.0.arr().write(|w| w.arr().set(full));
        self.set_repetitions(timing::repetitions(periods));
    }

    /// Repetitions alone; act from the next update on.
    pub fn set_repetitions(self, repetitions: u8) {
        self.0.rcr().write(|w| w.rep().set(repetitions));
    }

    /// Each channel as line a or b of its axis.
    fn set_channels(self, timer: PwmTimer, board: &Board, axes: usize, full: u16) {
        let (a, b) = centres(board.stage);
        let centres = [0, 1, 2, 3].map(|channel| if board.is_line_b(timer, channel) { b } else { a });
        self.0.ccmr1_output().write(|w| {
            w.ocpe(0).set_bit().ocpe(1).set_bit();
            w.ocm(0).variant(mode(centres[0])).ocm(1).variant(mode(centres[1]))
        });
        self.0.ccmr2_output().write(|w| {
            w.oc3pe().set_bit().oc4pe().set_bit();
            w.oc3m().set(mode(centres[2]) as u8).oc4m().set(mode(centres[3]) as u8)
        });
        for (channel, centre) in centres.into_iter().enumerate() {
            self.compare(channel, centre, full).set_level(0);
        }
        let low_sides = board.low_sides(timer, axes);
        self.0.ccer().write(|w| {
            w.cc1e().set_bit().cc2e().set_bit().cc3e().set_bit().cc4e().set_bit();
            w.cc1ne().bit(low_sides & 1 != 0).cc2ne().bit(low_sides & 2 != 0).cc3ne().bit(low_sides & 4 != 0)
        });
    }

    /// OSSI 1: disabled outputs are driven to their idle level, low, instead of floating. BKE 1, BKP 0: a low break
    /// input disables them, where the board has one. AOE 0: they stay disabled. LOCK 1: dead time and break can no longer be rewritten by a
    /// program gone astray until the next reset.
    fn set_break(self, board: &Board) {
        let dead_time = match board.stage.outputs {
            Outputs::SingleEnded => 0,
            Outputs::Complementary { dead_time_ns } => {
                timing::dead_time(dead_time_ns).expect("a power stage's dead time is at most 6,000 ns")
            }
        };
        self.0.bdtr().write(|w| {
            w.dtg().set(dead_time);
            w.lock().set(0b01);
            w.ossi().set_bit().ossr().set_bit();
            w.bke()
                .bit(board.fault == FaultLine::Breaks)
                .bkp()
                .clear_bit()
                .aoe()
                .clear_bit()
                .moe()
                .clear_bit()
        });
    }

    /// Starts counting.
    pub fn start(self) {
        self.0.cr1().modify(|_, w| w.cen().set_bit());
    }

    /// One of the four lines.
    pub fn compare(self, channel: usize, centre: Centre, full: u16) -> Compare {
        Compare { timer: self, channel, centre, full }
    }

    /// True if the counter runs down, as it does after the upper turning point.
    pub fn runs_down(self) -> bool {
        self.0.cr1().read().dir().bit_is_set()
    }

    /// True if the break input has switched the outputs off since [`Timer::clear_break`].
    pub fn has_broken(self) -> bool {
        self.0.sr().read().bif().bit_is_set()
    }

    /// Forgets a break. While the break input is still active the flag comes back at once.
    pub fn clear_break(self) {
        // SAFETY: flags are cleared by writing 0; ones leave them (RM0090 section 17.4.5).
        self.0.sr().write(|w| unsafe { w.bits(!BREAK_FLAG) });
    }

    /// Lets the outputs follow the compare registers. Without effect while the break input is active.
    pub fn enable_outputs(self) {
        self.0.bdtr().modify(|_, w| w.moe().set_bit());
    }

    /// Holds all outputs of this timer low, at once. From any context.
    pub fn disable_outputs(self) {
        self.0.bdtr().modify(|_, w| w.moe().clear_bit());
    }
}

/// TIM1, and TIM8 where an axis needs it. They start a few clocks apart; only TIM1 paces and triggers.
pub fn timers<const N: usize>(board: &'static Board) -> impl Iterator<Item = Timer> {
    named_timers::<N>(board).map(|(_, timer)| timer)
}

pub fn named_timers<const N: usize>(board: &'static Board) -> impl Iterator<Item = (PwmTimer, Timer)> {
    let named = [PwmTimer::One, PwmTimer::Eight].into_iter();
    named.filter(|name| *name == PwmTimer::One || board.uses(*name, N)).map(|name| (name, Timer::of(name)))
}

/// TIM1_SR bit BIF, RM0090 section 17.4.5.
const BREAK_FLAG: u32 = 1 << 7;

/// OCxM codes 110 and 111, RM0090 section 17.4.7.
fn mode(centre: Centre) -> OC1M {
    match centre {
        Centre::Bottom => OC1M::PwmMode1,
        Centre::Top => OC1M::PwmMode2,
    }
}

/// One PWM line.
#[derive(Clone, Copy)]
pub struct Compare {
    timer: Timer,
    channel: usize,
    centre: Centre,
    full: u16,
}

impl Compare {
    /// Both ends are exact: 0 is always low, F always high, whatever the centre.
    fn set_level(&mut self, level: u16) {
        let compare = match self.centre {
            Centre::Bottom => level,
            Centre::Top => self.full.saturating_sub(level),
        };
        self.timer.0.ccr(self.channel).write(|w| w.ccr().set(compare));
    }
}

impl pwm::ErrorType for Compare {
    type Error = Infallible;
}

impl SetDutyCycle for Compare {
    fn max_duty_cycle(&self) -> u16 {
        self.full
    }

    fn set_duty_cycle(&mut self, level: u16) -> Result<(), Infallible> {
        self.set_level(level);
        Ok(())
    }
}

/// The main output enable as the enable line of a discrete bridge.
#[derive(Clone, Copy)]
pub struct MainOutput(pub Timer);

impl digital::ErrorType for MainOutput {
    type Error = Infallible;
}

impl OutputPin for MainOutput {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.disable_outputs();
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.enable_outputs();
        Ok(())
    }
}
