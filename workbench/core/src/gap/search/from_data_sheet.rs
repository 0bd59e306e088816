//! A data sheet that the log contradicts: where one base parameter alone, freed from its tolerance, removes most of the gap and moves
//! far beyond what the file allows, a second search begins with it.
//!
//! A file whose inertia is three times too large leaves a gap at every change of speed. Anything that follows the acceleration
//! explains a part of it (a delay, a lag, another mass), so such a set is not left to the race among all effects.

use super::Search;
use super::race::looked_at;
use super::rounds::Path;
use crate::gap::acceptance;
use crate::gap::acceptance::noise::{at_floor, far, inside_tolerance};
use crate::gap::fit::SEARCH;
use crate::gap::fit::hypothesis::Slot;
use crate::gap::fit::scored::{Scored, dispersion, score_with};
use crate::system::effects::{Effect, INERTIA, MOTOR_GAIN, RESISTANCE};
use crate::system::threads::of_each;

/// Base parameters, the least known first: no label states the inertia, to which the load belongs, while a resistance and a no-load
/// speed are measured in a minute. Where two of them explain a log equally well the first one is said, and the other is its rival. A
/// viscous friction is no number of a data sheet.
const SUSPECTS: [&Effect; 3] = [&INERTIA, &MOTOR_GAIN, &RESISTANCE];
/// A parameter that wants out of its tolerance lies this far towards the end of the two tolerances that a fit may
/// use. Chosen by judgement; not studied.
const STRAINED: f64 = 1.8;
/// What is freed must remove this share of the gap (squared, above the noise) that the parameters leave within their
/// tolerances. An inertia three times too large removes 0.97, with a friction of 6 % of the supply hidden beside it.
/// Origin: in 140 drawn cases a parameter that goes beyond twice in place of another effect removes 0.32 to 0.76, and
/// 0.95 twice, where the later steps of the search took it out again (decision 0291).
const REMOVES: f64 = 0.9;

impl<'a> Search<'a, '_> {
    /// The base with the parameter that the log contradicts, if it explains most of the gap alone. Two of them are left to the search:
    /// inertia and motor constant together follow an encoder's scale that is wrong.
    pub(super) fn contradicted(&self, base: &Scored<'a>) -> Option<Scored<'a>> {
        if at_floor(base) || !strained(base) {
            return None;
        }
        let enough = |set: &Scored<'a>| {
            let excess = |set: &Scored<'a>| (set.fit.chi2 - set.fit.samples as f64).max(0.0);
            excess(set) < (1.0 - REMOVES) * excess(base) && inside_tolerance(set).is_none()
        };
        let far = |set: &Scored<'a>| far(set.hypothesis.value(0, 0, &set.fit.x));
        likeliest(self.freed(base).into_iter().filter(enough).collect()).filter(far)
    }

    /// The base with one parameter freed, each of them fitted.
    fn freed(&self, parent: &Scored<'a>) -> Vec<Scored<'a>> {
        let offered = SUSPECTS.into_iter().filter(|effect| self.offers(parent, effect));
        let tasks: Vec<(usize, &'static Effect)> = offered.map(|effect| (0, effect)).collect();
        let (basis, projector) = looked_at(parent);
        let count = tasks.len();
        let raced = self.fitted(std::slice::from_ref(parent), &[basis], &[projector], tasks, count);
        of_each(&raced, |set| self.refit(set, &SEARCH))
    }
}

/// The likelier end of two searches: one from the data sheet put right, and the usual one. Where they explain a log equally well with
/// equally many names, it is the first, which says the less known parameter. The other stays as a rival. A friction that takes a large
/// part of the input is explained by a wrong motor constant too, but only with more names than one.
pub(super) fn likelier<'a>(
    righted: (Scored<'a>, Path<'a>),
    usual: (Scored<'a>, Path<'a>),
) -> (Scored<'a>, Path<'a>) {
    let nearest = if righted.0.fit.cost <= usual.0.fit.cost { &righted.0 } else { &usual.0 };
    let factor = dispersion(nearest);
    let [names, usual_names] = [&righted.0, &usual.0].map(|set| set.hypothesis.items.len());
    let margin = if names <= usual_names { acceptance::tied(factor) } else { 0.0 };
    let holds = score_with(&righted.0, factor) <= score_with(&usual.0, factor) + margin;
    let ((best, mut path), (other, others)) = if holds { (righted, usual) } else { (usual, righted) };
    path.others.push(other);
    path.others.extend(others.others);
    (best, path)
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
    let rank = |set: &Scored| SUSPECTS.iter().position(|effect| *effect == set.hypothesis.items[0].effect);
    sets.into_iter().filter(|set| set.fit.cost <= limit).min_by_key(rank)
}
