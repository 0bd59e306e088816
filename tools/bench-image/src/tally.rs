//! Counting.

use core::hint::black_box;
use cortex_m::peripheral::{SYST, syst::SystClkSource};

/// SysTick counts 24 bits, downwards.
const MASK: u32 = 0x00FF_FFFF;

/// Starts the counter.
pub fn start(mut systick: SYST) {
    systick.set_clock_source(SystClkSource::Core);
    systick.set_reload(MASK);
    systick.clear_current();
    systick.enable_counter();
}

/// Updates of one subject.
#[derive(Default)]
pub struct Tally {
    updates: u32,
    counts: u64,
    worst: u32,
}

impl Tally {
    /// Runs and counts one update.
    #[inline(always)]
    pub fn count<T>(&mut self, update: impl FnOnce() -> T) -> T {
        let before = SYST::get_current();
        let result = black_box(update());
        let counts = before.wrapping_sub(SYST::get_current()) & MASK;
        self.updates += 1;
        self.counts += u64::from(counts);
        self.worst = self.worst.max(counts);
        result
    }

    /// Tells the host, less what counting itself takes.
    pub fn print(&self, name: &str, tick_hz: u32) {
        let empty = empty();
        let instructions = |counts: u64| counts * 1000 / 2688;
        let updates = u64::from(self.updates.max(1));
        let average = instructions(self.counts * 10 / updates).saturating_sub(instructions(10 * empty));
        let worst = instructions(u64::from(self.worst)).saturating_sub(instructions(empty));
        semihosting::println!("{name};{tick_hz};{};{average};{worst}", self.updates);
    }
}

/// Counts between two readings with nothing between.
fn empty() -> u64 {
    let before = SYST::get_current();
    black_box(());
    u64::from(before.wrapping_sub(SYST::get_current()) & MASK)
}
