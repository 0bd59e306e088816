//! Waiting by the cycle counter of the core.

use super::timing::SYSTEM_HZ;
use cortex_m::peripheral::DWT;
use embedded_hal::delay::DelayNs;

/// Clocks of a millisecond.
pub const CLOCKS_PER_MS: u32 = SYSTEM_HZ / 1_000;

/// The shortest time that is a whole number of clocks, and how many.
const PERIOD_NS: u32 = 125;
const CLOCKS_PER_PERIOD: u32 = SYSTEM_HZ / (1_000_000_000 / PERIOD_NS);

/// The counter. It wraps every 25.6 s.
pub fn now() -> u32 {
    DWT::cycle_count()
}

/// Waits, busy.
pub struct Clocks;

impl DelayNs for Clocks {
    fn delay_ns(&mut self, nanoseconds: u32) {
        let begin = now();
        // 21 clocks in 125 ns. Without a 64-bit division, which would take 900 bytes.
        let (whole, rest) = (nanoseconds / PERIOD_NS, nanoseconds % PERIOD_NS);
        let clocks = whole * CLOCKS_PER_PERIOD + (rest * CLOCKS_PER_PERIOD).div_ceil(PERIOD_NS);
        while now().wrapping_sub(begin) < clocks {}
    }
}
