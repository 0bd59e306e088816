//! Findings as a table.

use super::trial::{Finding, MOST_COUNTS};
use super::world::Injury;
use crate::tracking::quantile;
use servo::protect::Fault;
use std::collections::BTreeMap;

/// The verdicts that are right, with the current sensed and without.
pub fn right(injury: Injury, sensed: bool) -> &'static [Fault] {
    match (injury, sensed) {
        (Injury::Stall, true) => &[Fault::Stalled],
        (Injury::EncoderUnplugged, true) => &[Fault::EncoderUnplugged],
        (Injury::MotorDisconnected, true) => &[Fault::MotorDisconnected],
        (Injury::Stall | Injury::EncoderUnplugged | Injury::MotorDisconnected, false) => &[Fault::NoMotion],
        (Injury::EncoderReversed | Injury::MotorReversed, _) => &[Fault::WrongDirection],
        (Injury::Jump(_) | Injury::Slip(_), _) => &[Fault::SlippingCounts],
        (Injury::Supply(share), _) if share < 1.0 => &[Fault::SupplyLow],
        (Injury::Supply(_), _) => &[Fault::SupplyHigh],
        (Injury::SupplyUnseen, _) => &[Fault::SupplyNotMeasured],
        (Injury::Current(_), _) => &[Fault::OverCurrent],
        (Injury::None, _) => &[Fault::None],
    }
}

/// How findings of one kind came out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Findings whose clock started.
    pub cases: usize,
    /// The verdict was the right one.
    pub right: usize,
    /// It left open what the current could have told.
    pub undecided: usize,
    /// It named something else.
    pub wrong: usize,
    /// Nothing was found.
    pub missed: usize,
    /// Open in the allowed time.
    pub in_time: usize,
    /// Open within [`MOST_COUNTS`].
    pub in_counts: usize,
    /// Right within max(100 ms, τ).
    pub told_in_time: usize,
    /// A whole shaft would have moved by the time at which the bridge must be open …
    pub decidable: usize,
    /// … and the bridge was open in both limits.
    pub decided: usize,
    /// Delays over what is allowed.
    pub delays: Vec<f64>,
    /// Expected counts.
    pub counts: Vec<f64>,
    /// True travel, counts.
    pub travel: Vec<f64>,
    /// What was said.
    pub verdicts: BTreeMap<&'static str, usize>,
}

impl Tally {
    /// Adds a finding.
    pub fn note(&mut self, injury: Injury, finding: &Finding) {
        // A bridge that is open before eight counts are expected is in time.
        let started = finding.delay_s.is_some() || finding.fault != Fault::None;
        if !started {
            return;
        }
        let delay = finding.delay_s.unwrap_or(0.0);
        self.cases += 1;
        self.decidable += usize::from(finding.decidable);
        self.decided += usize::from(finding.decidable && finding.in_limits());
        *self.verdicts.entry(finding.fault.name()).or_default() += 1;
        if finding.fault == Fault::None {
            self.missed += 1;
            return;
        }
        let right = right(injury, finding.sensed).contains(&finding.fault);
        self.right += usize::from(right);
        let undecided = !right && finding.fault == Fault::NoMotion;
        self.undecided += usize::from(undecided);
        self.wrong += usize::from(!right && !undecided);
        self.in_time += usize::from(delay <= finding.allowed_s);
        self.in_counts += usize::from(finding.expected_counts <= MOST_COUNTS);
        self.told_in_time += usize::from(right && delay <= finding.tau_s.max(0.1));
        self.delays.push(delay / finding.allowed_s);
        self.counts.push(finding.expected_counts);
        self.travel.push(finding.travel_counts);
    }

    /// Head of the table.
    pub const HEAD: &'static str = "\
        | fault | when | current | cases | right / undecided / wrong / missed | right within max(100 ms, τ) | \
        open in time | open within 24 counts | decidable: in both limits | \
        delay over allowed, median / p95 / worst | expected counts, median / p95 / worst | true travel, counts, \
        median / p95 / worst |\n|---|---|---|---|---|---|---|---|---|---|---|---|";

    /// One row.
    pub fn row(&self, fault: &str, when: &str, current: &str) -> String {
        let three = |values: &[f64], digits: usize| {
            let at = |p| quantile(values.iter().copied(), p);
            format!("{:.digits$} / {:.digits$} / {:.digits$}", at(0.5), at(0.95), at(1.0))
        };
        let percent = |n: usize| 100.0 * n as f64 / self.cases.max(1) as f64;
        format!(
            "| {fault} | {when} | {current} | {} | {} / {} / {} / {} | {:.0} % | {:.0} % | {:.0} % | {} of {} | {} | {} | {} |",
            self.cases,
            self.right,
            self.undecided,
            self.wrong,
            self.missed,
            percent(self.told_in_time),
            percent(self.in_time),
            percent(self.in_counts),
            self.decided,
            self.decidable,
            three(&self.delays, 2),
            three(&self.counts, 1),
            three(&self.travel, 1),
        )
    }
}
