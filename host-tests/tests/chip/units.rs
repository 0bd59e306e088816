//! Arithmetic of the tick against the plain formula, in wider integers.

use proptest::prelude::*;
use servo::units::{ERROR_BITS, Position, bounded, ticks_in};

proptest! {
    #[test]
    fn a_bound_cuts_to_its_ends_and_leaves_the_rest(value: i64, limit in 1..1i32 << 30) {
        for value in [value, value >> 12, value >> 30] {
            let end = i64::from(limit) << 32;
            prop_assert_eq!(bounded(value, limit), value.clamp(-end, end - 1));
        }
    }

    #[test]
    fn a_difference_of_positions_saturates(one: i64, other: i64, near in -1i64 << 53..1i64 << 53) {
        for (one, other) in [(one, other), (one, one.wrapping_add(near)), (one, one.wrapping_add(near >> 9))] {
            let difference = one.wrapping_sub(other) >> (32 - ERROR_BITS);
            let expected = difference.clamp(i32::MIN.into(), i32::MAX.into());
            prop_assert_eq!(i64::from(Position(one).minus(Position(other))), expected);
        }
    }

    #[test]
    fn milliseconds_are_rounded_down_to_ticks(milliseconds: u32, tick_hz in 1_000u32..=20_000) {
        for milliseconds in [milliseconds, milliseconds % 100_000] {
            let exact = u64::from(milliseconds) * u64::from(tick_hz) / 1000;
            prop_assert_eq!(u64::from(ticks_in(milliseconds, tick_hz)), exact.min(u32::MAX.into()));
        }
    }
}

#[test]
fn the_ends_themselves_are_exact() {
    for limit in [1, 1 << 20, 1 << 23] {
        let end = i64::from(limit) << 32;
        for value in [-end - 1, -end, -end + 1, end - 1, end, end + 1, i64::MIN, i64::MAX] {
            assert_eq!(bounded(value, limit), value.clamp(-end, end - 1), "{value} within {limit}");
        }
    }
    let most = 1i64 << 51;
    for difference in [-most - 1, -most, most - 1, most] {
        let expected = (difference >> 20).clamp(i32::MIN.into(), i32::MAX.into());
        assert_eq!(i64::from(Position(difference).minus(Position(0))), expected, "{difference}");
    }
}
