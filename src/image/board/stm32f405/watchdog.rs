//! The independent watchdog: if control ticks or idle stop, it resets the chip, and the pull-downs open the bridge.

use super::pac::IWDG;
use super::timing;
use core::sync::atomic::{AtomicBool, Ordering};

/// Many of the slowest ticks (1 ms), even from a fast oscillator (10.9 ms), and short against what a motor can do.
const RUNNING_MS: u32 = 16;
/// Longer than the erase of a 128 KiB sector, 4 s at worst with 8-bit parallelism (DS8626, flash memory
/// characteristics), during which the processor stands still; from a fast oscillator 8.5 s are 5.8 s.
const ERASING_MS: u32 = 8_500;

const KEY_START: u16 = 0xCCCC;
const KEY_UNLOCK: u16 = 0x5555;
const KEY_RELOAD: u16 = 0xAAAA;

/// Set by the control tick, taken by idle: the watchdog is fed only if both run.
static TICKED: AtomicBool = AtomicBool::new(false);

/// The watchdog, once started.
pub struct Watchdog {
    registers: IWDG,
}

impl Watchdog {
    /// Starts it; nothing but a reset stops it.
    pub fn start(registers: IWDG) -> Self {
        let watchdog = Self { registers };
        watchdog.key(KEY_START);
        watchdog.set_period(RUNNING_MS);
        watchdog
    }

    /// Feeds it if a control tick has run since the last time.
    pub fn turn(&mut self) {
        if TICKED.swap(false, Ordering::Relaxed) {
            self.key(KEY_RELOAD);
        }
    }

    /// Runs `erase`, which may stop the processor for seconds, with a period to match.
    pub fn while_erasing<R>(&mut self, erase: impl FnOnce() -> R) -> R {
        self.set_period(ERASING_MS);
        let result = erase();
        self.set_period(RUNNING_MS);
        result
    }

    /// A register still being transferred to the watchdog's own clock must not be written again (RM0090 section 21.4.4);
    /// that takes five of its clocks, 0.3 ms.
    fn set_period(&self, milliseconds: u32) {
        let (prescaler, reload) =
            timing::watchdog(milliseconds).expect("a period of the watchdog is in its range");
        self.wait_for_transfer();
        self.key(KEY_UNLOCK);
        // SAFETY: codes 0 … 6 are defined.
        self.registers.pr().write(|w| unsafe { w.pr().bits(prescaler) });
        self.registers.rlr().write(|w| w.rl().set(reload));
        self.wait_for_transfer();
        self.key(KEY_RELOAD);
    }

    fn wait_for_transfer(&self) {
        while self.registers.sr().read().bits() != 0 {}
    }

    fn key(&self, key: u16) {
        // SAFETY: the three keys are the only words written.
        self.registers.kr().write(|w| unsafe { w.key().bits(key) });
    }
}

/// Called by every control tick.
pub fn control_has_run() {
    TICKED.store(true, Ordering::Relaxed);
}
