//! Names for a model that is itself a fit to the log of a real rig, measured by shares of the residual.
//!
//! Such a residual is never as small as the sensor's noise. A name must remove a share of the squared error: on the log, on
//! the folds of the log that were not fitted, and on every held-out record. The log chooses, each held-out record may refuse.

use super::noise::{VALIDATED, cross_validated, stands_out};
use super::{Evidence, Weighed};
use crate::gap::acceptance::prediction::held_out_variation;
use crate::gap::dataset::Dataset;
use crate::gap::fit::SEARCH;
use crate::gap::fit::scored::{Scored, compared};
use crate::gap::residual::inflation;
use crate::system::effects::{Meaning, Starts};
use std::f64::consts::TAU;
use std::sync::OnceLock;

/// Logarithm of the likelihood ratio that each further number must bring, the samples counted by their correlation.
/// Origin: Schwarz's price (Ann. Statist. 6, 1978), ln(n)/2, at 400 samples; Akaike's is 1.
const PER_NUMBER: f64 = 3.0;
/// Whole periods that a log must have seen before a period is named. Chosen by judgement; not studied.
const PERIODS: f64 = 3.0;
/// A name that joins may leave so many times as much on one held-out record, if it leaves less on all of them
/// together: a further name may be what that record needs. Chosen by judgement; not studied.
const WORSE: f64 = 1.05;
/// Without a name that stays, the squared error of every held-out record grows by this factor at least. Chosen by
/// judgement; not studied.
const HELPS_EACH: f64 = 1.05;

/// A name joins if it removes a share of the log's squared error, fitted and not fitted.
pub struct Joining {
    /// The share.
    share: f64,
    /// χ² of the smaller set on the folds that were not fitted, once it was asked for.
    validated: OnceLock<f64>,
}

impl Joining {
    /// For one smaller set.
    pub fn new(share: f64) -> Self {
        Self { share, validated: OnceLock::new() }
    }
}

impl<'a> Evidence<'a> for Joining {
    type Data = Dataset;

    fn weighed(&self, smaller: &Scored<'a>, larger: &Scored<'a>) -> Weighed {
        let ratio = larger.fit.cost / smaller.fit.cost;
        let more = larger.hypothesis.effect_slots() as f64 - smaller.hypothesis.effect_slots() as f64;
        let beyond_chance = || -ratio.ln() * effective_samples(larger) >= 2.0 * PER_NUMBER * more.max(1.0);
        let gain = 1.0 - ratio;
        Weighed { gain, cost: self.share, material: gain >= self.share && beyond_chance() }
    }

    fn confirmed(&self, smaller: &Scored<'a>, larger: &Scored<'a>, gain: f64) -> bool {
        if !stands_out(smaller, larger) || !goes_round(larger) {
            return false;
        }
        let validated = self.validated.get_or_init(|| cross_validated(smaller));
        cross_validated(larger) < (1.0 - VALIDATED * gain) * validated
    }
}

/// True if no held-out record refuses a larger set. `before`: squared errors of the records without it.
pub fn agreed(before: &[f64], larger: &Scored) -> bool {
    let after = larger.held_out();
    no_more(&after, before, WORSE) && sum(&after) <= sum(before)
}

/// By what a name that stays is measured.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// By which share the squared error grows without it, on the log or on the held-out records together, whichever is less.
    Growth,
    /// By how many points the held-out fit falls without it.
    Points,
}

/// A name stays if enough is lost without it, everything else fitted anew.
pub struct Staying {
    measure: Measure,
    least: f64,
    /// Squared errors of the held-out records with it.
    with: Vec<f64>,
}

impl Staying {
    /// For one larger set.
    pub fn new(larger: &Scored, measure: Measure, least: f64) -> Self {
        Self { measure, least, with: larger.held_out() }
    }

    /// By which share the squared error grows.
    fn growth(&self, without: &[f64], log: f64) -> f64 {
        let ratio = |a: f64, b: f64| a / b.max(f64::MIN_POSITIVE);
        let every = without.iter().zip(&self.with).map(|(a, b)| ratio(*a, *b));
        let least = every.fold(f64::INFINITY, f64::min);
        // A record that the name does not help by a little is no proof of it, however much the others are helped.
        if least < HELPS_EACH { least - 1.0 } else { log.min(ratio(sum(without), sum(&self.with))) - 1.0 }
    }
}

impl<'a> Evidence<'a> for Staying {
    type Data = Dataset;

    fn weighed(&self, smaller: &Scored<'a>, larger: &Scored<'a>) -> Weighed {
        let without = smaller.held_out();
        let fit = |errors: &[f64]| 100.0 * (1.0 - left_open(larger, errors));
        let gain = match self.measure {
            Measure::Growth => self.growth(&without, smaller.fit.cost / larger.fit.cost),
            Measure::Points => fit(&self.with) - fit(&without),
        };
        Weighed { gain, cost: self.least, material: true }
    }
}

/// Part of the variation of the held-out data (not squared) that these squared errors leave open.
pub fn left_open(set: &Scored, errors: &[f64]) -> f64 {
    (sum(errors) / held_out_variation(set.hypothesis.dataset).max(f64::MIN_POSITIVE)).sqrt()
}

/// Whether another set leaves at most so many times as much as this one on the log, and on every held-out record.
pub fn near(scored: &Scored, log: f64, held_out: f64) -> impl Fn(&Scored) -> bool + use<> {
    let (most, errors) = (log * scored.fit.cost, scored.held_out());
    move |other| other.fit.cost <= most && no_more(&other.held_out(), &errors, held_out)
}

/// Whether the log saw some whole periods of the newest effect, if its period was looked for: one wave along the whole way is
/// a shape and no period.
fn goes_round(set: &Scored) -> bool {
    let (hypothesis, newest) = (&set.hypothesis, set.hypothesis.items.len() - 1);
    let effect = hypothesis.items[newest].effect;
    let (meaning, length) = match effect.starts {
        Starts::PositionScan => (Meaning::PeriodsPerTurn, hypothesis.dataset.travel() / TAU),
        Starts::TimeScan => (Meaning::Frequency, hypothesis.dataset.scales.duration),
        _ => return true,
    };
    let value = effect.place(meaning).map(|place| hypothesis.value(newest, place, &set.fit.x));
    value.is_none_or(|value| value * length >= PERIODS)
}

/// The sum of some errors.
pub fn sum(errors: &[f64]) -> f64 {
    errors.iter().sum()
}

/// True if each error is at most `share` of its counterpart.
pub fn no_more(errors: &[f64], than: &[f64], share: f64) -> bool {
    errors.iter().zip(than).all(|(error, than)| *error <= share * than)
}

/// The number of samples, those that tell the same counted once.
fn effective_samples(scored: &Scored) -> f64 {
    let residuals = compared(&scored.hypothesis, &scored.fit.x, &SEARCH);
    scored.fit.samples as f64 / inflation(&residuals)
}
