//! Waiting by the cycle counter of the core.

use super::timing::SYSTEM_HZ;
use cortex_m::peripheral::DWT;
use embedded_hal::delay::DelayNs;

/// Clocks of a millisecond.
pub const CLOCKS_PER_MS: u32 = SYSTEM_HZ / 1_000;

/// The counter. It wraps every 25.6 s.
pub fn now() -> u32 {
    DWT::cycle_count()
}

/// Waits, busy.
pub struct Clocks;

impl DelayNs for Clocks {
    fn delay_ns(&mut self, nanoseconds: u32) {
        let begin = now();
        let clocks = (u64::from(nanoseconds) * u64::from(SYSTEM_HZ)).div_ceil(1_000_000_000) as u32;
        while now().wrapping_sub(begin) < clocks {}
    }
}
