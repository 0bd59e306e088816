//! How often protection looks at an axis: a power of two of control ticks.

use crate::config::Scale;

/// Looks per second, at least (or every tick, where ticks are slower): every 0.2 to 0.4 ms.
const LOOK_HZ: u32 = 2500;
/// Counts between two looks at rated speed, at most: speeds are counts per look in Q20 and stay in range at four times that.
const MOST_COUNTS: u32 = 500;

/// Control ticks between two looks, as a shift.
pub(super) fn look_bits(scale: &Scale) -> u32 {
    let by_rate = scale.config.tick_hz / LOOK_HZ;
    let by_speed = (MOST_COUNTS << 16) / scale.rated_counts_per_tick_q16.max(1);
    by_rate.min(by_speed).max(1).ilog2()
}

/// Looks per second, and control ticks between two of them as a shift.
pub(super) fn looks(scale: &Scale) -> (f32, u32) {
    let bits = look_bits(scale);
    (scale.config.tick_hz as f32 / (1u32 << bits) as f32, bits)
}
