//! Where the cost is rugged, an evolution goes on: teeth that meet a moment too early send a load elsewhere, and the
//! derivative of that moment says nothing about the next.
//!
//! Covariance matrix adaptation (Hansen, Ostermeier: Evolutionary Computation 9(2), 2001), always with the same seeds:
//! the same log makes the same report.

use super::Search;
use super::adaptation::Adaptation;
use super::screening::{Projector, Start, started};
use crate::gap::acceptance::noise::{VISIBLE, at_floor};
use crate::gap::dataset::PACK;
use crate::gap::fit::hypothesis::{Hypothesis, Slot};
use crate::gap::fit::problem::dot;
use crate::gap::fit::scored::Scored;
use crate::gap::fit::{Evaluator, Fit, SEARCH, Setting, fit};
use crate::gap::order::by_least;
use crate::system::effects::{Effect, Starts};
use crate::system::threads::*;
use nalgebra::DVector;

/// Simulations that CMA-ES may spend on the parameters of one effect, those of the base following linearly. A budget
/// of computing time, chosen by judgement: a hundred for each of its up to three parameters.
const FOR_ONE: usize = 300;
/// Simulations that CMA-ES may spend on all parameters of a set. A budget of computing time, chosen by judgement.
const FOR_ALL: usize = 1000;
/// Simulations of one generation. Origin: Hansen's default 4 + 3·ln(n) is 11 for ten parameters; a few more suit a
/// cost with many hollows.
const POPULATION: usize = 14;
/// Initial standard deviation of a nuisance parameter when all parameters move, in tolerances: the fit before has
/// already placed it. Chosen by judgement; not studied.
const NUISANCE: f64 = 0.3;
/// Initial standard deviation of the parameters of an effect with a non-smooth cost when all parameters move, as a
/// part of that of the search over its grid. Chosen by judgement; not studied.
const NEAR: f64 = 0.25;
/// Initial relative standard deviation of the parameters of the other effects of the set: the fit before has placed
/// them. Chosen by judgement; not studied.
const OTHERS: f64 = 0.02;
/// How far away another hollow is looked for, in those standard deviations: a base parameter moves by nearly its tolerance, and the
/// numbers of teeth by three quarters of what their grid leaves open. Origin: in 17 drawn cases with teeth 45 of 50 intervals (95 %) of
/// effects hold the truth with 1, and 48 with 3. Where only hollows as low as this one counted, 34 did, and 71 of 102 of base
/// parameters instead of 97.
const APART: f64 = 3.0;
/// An evolution ends when the costs of a generation differ by less than this part. Chosen by judgement; not studied.
const TOGETHER: f64 = 1e-3;
/// Evolutions of all numbers, one after the other, as multiples of those standard deviations: a narrow one ends in
/// the nearest hollow, a wide one may find the next. Chosen by judgement; not studied.
const WIDTHS: [f64; 4] = [1.0, 2.0, 0.5, 1.0];

/// The relative standard deviations of an effect's parameters, if its cost is rugged.
pub(super) fn spread(effect: &Effect) -> Option<&'static [f64]> {
    match effect.starts {
        Starts::Rugged(_, spread) => Some(spread),
        _ => None,
    }
}

/// The newest effect of a set, evolved from a start; the parent's numbers follow linearly.
pub(super) fn evolved(child: &Hypothesis, parent: &Scored, projector: &Projector, start: &[f64]) -> Vec<f64> {
    let new = child.items.len() - 1;
    let effect = child.items[new].effect;
    let Some(spread) = spread(effect) else {
        return start.to_vec();
    };
    let defaults = effect.parameters.iter().map(|p| p.default.unwrap_or(0.0));
    let mut begin: Vec<f64> = defaults.collect();
    for (slot, x) in child.slots.iter().zip(start) {
        match slot {
            Slot::Effect { item, parameter } if *item == new => begin[*parameter] = *x,
            _ => {}
        }
    }
    let place = |z: &DVector<f64>| -> Vec<f64> {
        let moved = begin.iter().zip(spread.iter().zip(z.iter()));
        let values: Vec<f64> = moved.map(|(value, (spread, z))| value * (spread * z).exp()).collect();
        started(child, parent, &values)
    };
    let evaluator = Evaluator::new(child, &SEARCH);
    let followed = |members: &[DVector<f64>]| -> Vec<Start> {
        let places: Vec<Vec<f64>> = members.iter().map(place).collect();
        let residuals = evaluator.of_kin(&places);
        let both = places.iter().zip(&residuals);
        both.map(|(x, residuals)| projector.projected(child, x, residuals)).collect()
    };
    let predicted =
        |members: &[DVector<f64>]| followed(members).iter().map(|start| start.predicted_cost).collect();
    followed(&[least(begin.len(), FOR_ONE, 0, predicted)]).swap_remove(0).x
}

impl<'a> Search<'a, '_> {
    /// A set with a rugged effect that leaves more than the noise: all its numbers evolve and are fitted again, as long as
    /// that helps.
    pub(super) fn settled(&self, mut scored: Scored<'a>) -> Scored<'a> {
        for (seed, width) in WIDTHS.into_iter().enumerate() {
            if !scored.hypothesis.is_rugged() || at_floor(&scored) {
                break;
            }
            let made = evolved_whole(&scored, seed as u64, width);
            if made.cost >= scored.fit.cost {
                break;
            }
            scored = self.scored(scored.hypothesis.clone(), made);
        }
        scored
    }
}

/// All numbers of a set, evolved and fitted again.
fn evolved_whole(scored: &Scored, seed: u64, width: f64) -> Fit {
    let hypothesis = &scored.hypothesis;
    let place = |z: &DVector<f64>| -> Vec<f64> {
        let moved = scored.fit.x.iter().zip(z.iter()).enumerate();
        moved.map(|(k, (x, z))| moved_by(hypothesis, k, *x, width * z)).collect()
    };
    let evaluator = Evaluator::new(hypothesis, &SEARCH);
    let costs = |members: &[DVector<f64>]| {
        let places: Vec<Vec<f64>> = members.iter().map(place).collect();
        evaluator.of_kin(&places).iter().map(|residuals| dot(residuals, residuals)).collect()
    };
    let best = least(scored.fit.x.len(), FOR_ALL, seed, costs);
    fit(hypothesis, &place(&best), &SEARCH)
}

/// Squared distances of hollows beside the one in which a set with a rugged effect was fitted: what its numbers are uncertain by besides
/// their covariance, which knows one hollow only. Each is found by a fit from a place where one number has moved. It counts whole if no
/// name could depend on the difference, or if what it leaves is of the size of what this one leaves. Of a higher one the part counts by
/// which a funnel that rises with the square of the distance is lower where the truth may lie.
pub fn scatter(scored: &Scored) -> Vec<f64> {
    let mut sums = vec![0.0; scored.fit.x.len()];
    let hypothesis = &scored.hypothesis;
    if !hypothesis.is_rugged() {
        return sums;
    }
    let begin = |k: usize| -> Vec<f64> {
        let moved = scored.fit.x.iter().enumerate();
        moved.map(|(at, x)| if at == k { moved_by(hypothesis, k, *x, APART) } else { *x }).collect()
    };
    let starts = |k: &usize| matches!(hypothesis.slots[*k], Slot::Start { .. });
    let begins: Vec<Vec<f64>> = (0..sums.len()).filter(|k| !starts(k)).map(begin).collect();
    let nearest = Setting { iterations: SEARCH.iterations / 2, ..SEARCH };
    let centre = fit(hypothesis, &scored.fit.x, &nearest);
    let fits = of_each(&begins, |x| fit(hypothesis, x, &nearest));
    let samples = centre.samples as f64;
    let alike_within = (VISIBLE * VISIBLE * samples).max(centre.chi2 - samples);
    for it in &fits {
        let part = alike_within / alike_within.max(it.cost - centre.cost);
        let distances = it.x.iter().zip(&scored.fit.x).map(|(a, b)| (a - b).powi(2) * part);
        sums.iter_mut().zip(distances).for_each(|(sum, distance)| *sum += distance);
    }
    sums
}

/// A number of a set, moved by `z` standard deviations inside its bounds.
fn moved_by(hypothesis: &Hypothesis, slot: usize, x: f64, z: f64) -> f64 {
    let moved = match hypothesis.slots[slot] {
        Slot::Effect { item, parameter } => {
            let spread = spread(hypothesis.items[item].effect).map_or(OTHERS, |it| NEAR * it[parameter]);
            x * (spread * z).exp()
        }
        _ => x + NUISANCE * z,
    };
    let (lower, upper) = hypothesis.bounds(slot);
    moved.clamp(lower, upper)
}

/// Where a cost is least, in standard deviations from the place where the evolution begins; that place if nothing is
/// better. `costs`: those of some members, in their order.
fn least(
    dimensions: usize,
    simulations: usize,
    seed: u64,
    costs: impl Fn(&[DVector<f64>]) -> Vec<f64> + Sync,
) -> DVector<f64> {
    let mut adaptation = Adaptation::new(dimensions, POPULATION, seed);
    let begin = DVector::zeros(dimensions);
    let mut best = (costs(std::slice::from_ref(&begin))[0], begin);
    for _ in 0..simulations / POPULATION {
        let members = adaptation.generation(POPULATION);
        let found: Vec<f64> = each(members.chunks(PACK).collect::<Vec<_>>()).flat_map_iter(&costs).collect();
        let mut ranked: Vec<(f64, &DVector<f64>)> = found.into_iter().zip(&members).collect();
        by_least(&mut ranked, |it| it.0);
        let ((least, member), most) = (ranked[0], ranked[POPULATION - 1].0);
        if least < best.0 {
            best = (least, member.clone());
        }
        if most < least * (1.0 + TOGETHER) {
            break;
        }
        adaptation.learn(&ranked.iter().map(|(_, member)| *member).collect::<Vec<_>>());
    }
    best.1
}
