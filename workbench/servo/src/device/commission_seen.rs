//! What a commissioning has seen, in words and numbers: how the axis file is contradicted, and when what happened.

use super::link::advice;
use servo::commission::{CommissionReport, Outcome};
use servo::config::Config;
use servo::identify::estimate::{GAIN_FRAC, Reason, Reported};

/// Measured over declared speed that rpm in place of rad/s give: 1/9.55, right within 40 %.
const LIKE_RPM: std::ops::Range<f32> = 0.065..0.155;

/// Why it was refused, with the numbers that it has seen.
pub(super) fn refusal(
    reason: Reason,
    outcome: &Outcome,
    report: &CommissionReport,
    config: &Config,
) -> String {
    let numbers = numbers(reason, outcome, report, config);
    numbers.map_or(String::new(), |numbers| numbers + "; ") + advice(reason)
}

/// A sentence for every reason for which a number is not to be used.
pub(super) fn doubts(outcome: &Outcome, report: &CommissionReport, config: &Config) -> Vec<String> {
    let found = &report.estimates;
    let numbers = [found.dead_zone_pos_v, found.dead_zone_neg_v, found.gain_rad_s_per_v];
    let known = numbers.iter().filter(|number| number.value.is_some() && report.refused.is_none());
    let mut reasons: Vec<Reason> = known.filter_map(|number| number.reason).collect();
    reasons.dedup();
    reasons.iter().map(|&reason| refusal(reason, outcome, report, config)).collect()
}

fn numbers(reason: Reason, outcome: &Outcome, report: &CommissionReport, config: &Config) -> Option<String> {
    let found = &report.estimates;
    match reason {
        Reason::DirectionChanged => Some(format!("the direction changed at {:.1} s", report.duration_s)),
        Reason::SpeedContradicts => {
            let (volts, rated) = (config.supply_nominal_v, config.rated_speed_rad_s);
            let seen = found.gain_rad_s_per_v.value? * volts;
            let ratio = seen / rated;
            let rpm = if LIKE_RPM.contains(&ratio) { ", as a speed in rpm gives" } else { "" };
            Some(format!(
                "by the count the shaft makes {seen:.0} rad/s at {volts:.1} V, and axis.rated_speed_rad_s says {rated:.0}: \
                 {ratio:.2} times{rpm}"
            ))
        }
        Reason::StartsHigher => {
            let sides = [("forwards", found.dead_zone_pos_v), ("backwards", found.dead_zone_neg_v)];
            let higher = |number: &Reported| number.reason == Some(Reason::StartsHigher);
            let (way, number) = sides.into_iter().find(|(_, number)| higher(number))?;
            let (turns, u95) = (number.value?, number.u95?);
            Some(format!("a start {way} takes {:.2} V, turning {turns:.2} V", turns + u95))
        }
        Reason::GainsDiffer => {
            let mean = found.gain_rad_s_per_v.value?;
            let skew = outcome.estimates.gain_skew as f32 / (1 << GAIN_FRAC) as f32;
            let [forwards, backwards] = [1.0 + skew, 1.0 - skew].map(|share| share * mean);
            Some(format!("the gain is {forwards:.2} rad/s/V forwards and {backwards:.2} backwards"))
        }
        _ => None,
    }
}

/// The measured supply, where that is the reason.
pub(super) fn supply(code: &str, supply_v: Option<f32>, config: &Config) -> Option<String> {
    let measured = supply_v.filter(|_| code.starts_with("supply_"))?;
    Some(format!("measured {measured:.1} V, supply.nominal_v says {:.1}; ", config.supply_nominal_v))
}
