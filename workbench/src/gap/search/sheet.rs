//! A data sheet that the log contradicts: where base parameters alone, freed from their tolerances, remove most of the gap and move
//! far beyond what the file allows, the search begins with them.
//!
//! A file whose inertia is three times too large leaves a gap at every change of speed. Anything that follows the acceleration
//! explains a part of it (a delay, a lag, another mass), so such a set is not left to the race among all effects.

use super::Search;
use super::score::{Scored, dispersion};
use super::worth::far;
use crate::gap::acceptance;
use crate::gap::fit::SEARCH;
use crate::gap::hypothesis::Slot;
use crate::gap::initial_guesses::Basis;
use crate::system::effects::{Effect, INERTIA, MOTOR_GAIN, RESISTANCE};

/// Base parameters, the least known first: no label states the inertia, to which the load belongs, while a resistance and a no-load
/// speed are measured in a minute. Where two of them explain a log equally well the first one is said, and the other is its rival. A
/// viscous friction is no number of a data sheet.
const SUSPECTS: [&Effect; 3] = [&INERTIA, &MOTOR_GAIN, &RESISTANCE];
/// A parameter that wants out of its tolerance lies this far towards the end of the two tolerances that a fit may use.
const STRAINED: f64 = 1.8;
/// What is freed must remove this share of the gap (squared, above the noise) that the parameters leave within their tolerances. With
/// a friction of 6 % of the supply hidden beside an inertia three times too large it removes 0.96; a lag or a friction that stands
/// in for an inertia removes 0.3 to 0.7 (50 drawn cases of each).
const REMOVES: f64 = 0.9;

impl<'a> Search<'a, '_> {
    /// The base with the parameters that the log contradicts, if they explain most of the gap.
    pub(super) fn contradicted(&self, base: &Scored<'a>) -> Option<Scored<'a>> {
        if self.at_floor(base) || !strained(base) {
            return None;
        }
        let enough = |set: &Scored<'a>| {
            let excess = |set: &Scored<'a>| (set.fit.chi2 - set.fit.samples as f64).max(0.0);
            excess(set) < (1.0 - REMOVES) * excess(base) && !self.any_inside_tolerance(set)
        };
        let singles = self.freed(base);
        let pairs = || singles.iter().flat_map(|single| self.freed(single)).collect();
        let accepted = |sets: Vec<Scored<'a>>| likeliest(sets.into_iter().filter(enough).collect());
        let found = accepted(singles.clone()).or_else(|| accepted(pairs()))?;
        let beyond = |index: usize| far(found.hypothesis.value(index, 0, &found.fit.x));
        (0..found.hypothesis.items.len()).any(beyond).then_some(found)
    }

    /// A set with one more base parameter freed, each of them fitted.
    fn freed(&self, parent: &Scored<'a>) -> Vec<Scored<'a>> {
        let offered = SUSPECTS.into_iter().filter(|effect| self.offers(parent, effect));
        let tasks: Vec<(usize, &'static Effect)> = offered.map(|effect| (0, effect)).collect();
        let bases = [Basis::new(&parent.hypothesis, &parent.fit.x)];
        let count = tasks.len();
        let raced = self.fitted(std::slice::from_ref(parent), &bases, tasks, count);
        raced.iter().map(|set| self.refit(set, &SEARCH)).collect()
    }
}

/// True if the fit has pushed a base parameter to the end of its tolerance.
fn strained(base: &Scored) -> bool {
    let slots = base.hypothesis.slots.iter().zip(&base.fit.x);
    slots.into_iter().any(|(slot, z)| matches!(slot, Slot::Base { .. }) && z.abs() > STRAINED)
}

/// The set of the least known parameters among those that fit as well as the best.
fn likeliest<'a>(sets: Vec<Scored<'a>>) -> Option<Scored<'a>> {
    let best = sets.iter().min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))?;
    let limit = best.fit.cost + acceptance::tied(dispersion(best));
    let rank = |set: &Scored| {
        let places =
            set.hypothesis.items.iter().map(|item| SUSPECTS.iter().position(|effect| *effect == item.effect));
        places.map(|place| place.unwrap_or(SUSPECTS.len())).sum::<usize>()
    };
    sets.into_iter().filter(|set| set.fit.cost <= limit).min_by_key(rank)
}
