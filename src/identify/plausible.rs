//! Numbers that are certain and cannot be right: starts against the line, gains against each other and against the axis file.

use super::estimate::{Estimates, Reason, Standing};
use super::trust::share;

/// A start takes at most this share of the dead zone, in 1/1024, and this much more, Q20 of nominal: 1.75 times and 2 %. Friction at
/// rest is up to 1.6 times that of motion, with its ripple 1.75 times; a drive that gives nothing below a threshold needs more.
const START_1024: i32 = 1_792;
const START_MARGIN: i32 = 20_972;
/// Gain times nominal supply over rated speed, Q20, outside of which the axis file is wrong: rated speed is right within 30 %, which is
/// 0.77 … 1.43, and the gain within 4 %.
const RATED_GAIN: core::ops::RangeInclusive<i32> = 765_460..=1_572_864;
/// Difference of the gains from their mean above which the mean is of no use, Q20: 10 %. Motors differ by 3 %.
const MOST_SKEW: i32 = 104_858;

/// Does a start take far more than the line through the moving points tells?
pub(super) fn starts_higher(start: i32, dead_zone: i32) -> bool {
    (start << 6) > share(dead_zone, START_1024).saturating_add(START_MARGIN)
}

/// Gains that the axis file or each other contradict. Nothing is right by a wrong scale of speed.
pub(super) fn contradict(estimates: &mut Estimates, chosen: bool) {
    let Estimates { gain, gain_skew, dead_zone, .. } = estimates;
    let not_excited = Standing::Doubtful(Reason::NotExcited);
    if gain_skew.saturating_abs() > MOST_SKEW && (chosen || gain.standing == Standing::Trusted) {
        // The slower direction spans less speed for that alone.
        for number in dead_zone.iter_mut().filter(|number| number.standing == not_excited) {
            number.standing = Standing::Doubtful(Reason::GainsDiffer);
        }
        gain.standing = Standing::Doubtful(Reason::GainsDiffer);
    } else if chosen && !RATED_GAIN.contains(&gain.value) {
        for number in dead_zone.iter_mut().chain([gain]) {
            number.standing = Standing::Doubtful(Reason::SpeedContradicts);
        }
    }
}
