//! Which set of effects explains a table: a beam over sets, then backward elimination.
//!
//! The score of a set is n·ln(mean square) + Σ(δ/tolerance)² + k·ln n (Schwarz, Annals of Statistics 6, 1978, with the
//! noise unknown). A beam keeps sets that do not help yet, because some effects help only together. An effect stays only
//! if it [earns its place](crate::gap::acceptance).

use super::candidates::forms;
use super::fit::Set;
use super::sets::Search;
use crate::gap::acceptance::{Others, decided};
use crate::gap::beam::{Growth, grown};
use crate::gap::fit::hypothesis::{Data, Item};
use crate::gap::order::by_least;
use crate::gap::tables::acceptance::OverTable;
use crate::system::effects::{Effect, Family, Forms, LIBRARY};
use crate::system::threads::*;

/// Sets kept at each depth: many, because a table of some dozen rows is fitted at once. Chosen by judgement; not
/// studied.
const BEAM: usize = 10;
/// A gain in score from which a round was no idle one. Chosen by judgement; not studied.
const CLEAR: f64 = 2.0;
/// Widths of a dead zone that are tried beside breakaway friction, as parts of the fitted one. Chosen by judgement;
/// not studied.
const NARROWED: [f64; 6] = [0.95, 0.9, 0.85, 0.8, 0.7, 0.6];
/// Speed above which breakaway friction is gone, at the start of a fit: this part of the largest. Chosen by
/// judgement; not studied.
const SLOW: f64 = 0.02;

impl<'a> Search<'a> {
    /// The set that explains the fitted rows.
    pub fn run(&self) -> Option<Set<'a>> {
        let best = self.eliminate(grown(&mut Rounds(self), self.nothing()?, 0));
        Some(self.united(self.refine(best)))
    }

    /// One width and an offset are two widths under other names, exactly; so are friction and a constant torque. Such a
    /// pair becomes the one effect that it is.
    fn united(&self, set: Set<'a>) -> Set<'a> {
        let Some((even, constant, uneven)) = even_and_constant(&set) else {
            return set;
        };
        let others = set.lacking(even.max(constant)).lacking(even.min(constant));
        let united = forms(uneven).into_iter().filter_map(|item| self.extended(&others, &item));
        best(united).filter(|best| best.score < set.score + 1.0).unwrap_or(set)
    }

    /// Adds refinements while one earns its place, then drops what they made superfluous.
    fn refine(&self, mut set: Set<'a>) -> Set<'a> {
        while let Some(larger) = self.best_refinement(&set) {
            set = self.eliminate(larger);
        }
        set
    }

    fn best_refinement(&self, set: &Set<'a>) -> Option<Set<'a>> {
        let mut offered = self.offer.refinements();
        offered.retain(|it| self.compatible(set, it.effect));
        let refined = |item: &Item| match item.effect.steady().map(|steady| steady.forms) {
            Some(Forms::FromRest(_)) => self.with_breakaway(set, item),
            _ => self.extended(set, item),
        };
        let mut larger: Vec<Set<'a>> = each(&offered).filter_map(refined).collect();
        by_least(&mut larger, |it| it.score);
        Some(decided(&OverTable(self.rows), set, Others::Larger, larger)?.0)
    }

    /// A set with breakaway friction. Without it the dead zone was drawn towards the voltage at which the motor starts, and
    /// no gradient leads back, because zone and breakaway have to move together: the starts narrow the zone step by step
    /// and put the breakaway where the table shows the motor starting.
    fn with_breakaway(&self, set: &Set<'a>, item: &Item) -> Option<Set<'a>> {
        let torque = self.rows.scales().torque;
        let mut begins = Vec::new();
        for narrowed in narrowed(set) {
            let plant = narrowed.plant();
            for volts in self.rows.restarts() {
                // Just below: the motor does start there.
                let level = 0.999 * plant.applied(volts).abs() * plant.torque_per_input();
                begins.push((narrowed.clone(), vec![0.0, level / torque, SLOW]));
            }
        }
        let fitted = |(narrowed, values): &(Set<'a>, Vec<f64>)| {
            self.extended_from(narrowed, item, std::slice::from_ref(values), false)
        };
        let fits: Vec<Set<'a>> = each(&begins).filter_map(fitted).collect();
        best(fits)
    }

    /// Drops what does not earn its place and simplifies what can be simpler, the least missed first.
    fn eliminate(&self, mut set: Set<'a>) -> Set<'a> {
        while let Some(simpler) = self.least_missed(&set) {
            set = simpler;
        }
        set
    }

    fn least_missed(&self, set: &Set<'a>) -> Option<Set<'a>> {
        let reduced = each(0..set.hypothesis.items.len()).flat_map_iter(|k| self.reductions(set, k));
        let reduced: Vec<Set<'a>> = reduced.collect();
        Some(decided(&OverTable(self.rows), set, Others::Smaller, reduced)?.0)
    }

    /// Effect k dropped, or in its simpler form.
    fn reductions(&self, set: &Set<'a>, k: usize) -> Vec<Set<'a>> {
        let simpler = simpler(&set.hypothesis.items[k]).into_iter();
        let substituted = simpler.filter_map(|item| self.substituted(set, k, &item));
        self.without(set, k).into_iter().chain(substituted).collect()
    }
}

/// The rounds of the beam over tables.
struct Rounds<'s, 'a>(&'s Search<'a>);

impl<'a> Growth for Rounds<'_, 'a> {
    type Set = Set<'a>;

    fn width(&self) -> usize {
        BEAM
    }

    fn children(&mut self, _: usize, _: &Set<'a>, beam: &[Set<'a>]) -> Vec<Set<'a>> {
        let candidates = self.0.offer.forms();
        let pairs = beam.iter().flat_map(|p| candidates.iter().map(move |c| (p, c)));
        let allowed = pairs.filter(|(parent, item)| self.0.compatible(parent, item.effect));
        let jobs: Vec<(&Set<'a>, &Item)> = allowed.collect();
        let extended = |(parent, item): &(&Set<'a>, &Item)| self.0.extended(parent, item);
        let mut sets: Vec<Set<'a>> = each(&jobs).filter_map(extended).collect();
        by_least(&mut sets, |it| it.score);
        let mut seen = std::collections::BTreeSet::new();
        sets.retain(|set| seen.insert(identity(set)));
        sets
    }

    /// The best child if it is better at all: what does not earn its place goes at the end.
    fn winner(&mut self, current: &Set<'a>, children: &mut Vec<Set<'a>>) -> Option<Set<'a>> {
        (children[0].score < current.score).then(|| children.remove(0))
    }

    fn accepted(&mut self, current: &Set<'a>, winner: Set<'a>, _: Vec<Set<'a>>) -> (Set<'a>, bool) {
        let clear = winner.score < current.score - CLEAR;
        (winner, clear)
    }

    fn may_pair(&mut self, _: &Set<'a>, _: Vec<Set<'a>>) -> bool {
        true
    }
}

/// The set with the lowest score.
pub fn best<'a>(sets: impl IntoIterator<Item = Set<'a>>) -> Option<Set<'a>> {
    sets.into_iter().min_by(|a, b| a.score.total_cmp(&b.score))
}

/// The set as it is, and with each width of its dead zone narrowed in steps, one side at a time and both together.
fn narrowed<'a>(set: &Set<'a>) -> Vec<Set<'a>> {
    let is_zone = |it: &Item| it.effect.family == Family::DeadZone;
    let mut all = vec![set.clone()];
    let Some(zone) = set.hypothesis.items.iter().position(is_zone) else { return all };
    let effect = set.hypothesis.items[zone].effect;
    let widths: Vec<usize> = (0..effect.parameters.len())
        .filter(|k| effect.parameters[*k].default.is_none())
        .filter_map(|k| set.hypothesis.slot(zone, k))
        .collect();
    for share in NARROWED {
        for which in 1..1 << widths.len() {
            let mut narrow = set.clone();
            let sides = widths.iter().enumerate().filter(|(side, _)| which >> side & 1 == 1);
            sides.for_each(|(_, slot)| narrow.fit.x[*slot] *= share);
            all.push(narrow);
        }
    }
    all
}

/// Simpler forms of the same thing: optional parameters at their defaults, one width for both directions.
fn simpler(item: &Item) -> Vec<Item> {
    let even = item.effect.relations.uneven_of.map(|uneven| uneven.even);
    let kin = [item.effect].into_iter().chain(even).flat_map(forms);
    kin.filter(|other| other.size() < item.size()).collect()
}

/// The places of an even effect and of a constant in a set, and the uneven effect that the two make together.
fn even_and_constant(set: &Set) -> Option<(usize, usize, &'static Effect)> {
    let items = &set.hypothesis.items;
    let place = |effect: &Effect| items.iter().position(|it| it.effect == effect);
    LIBRARY.iter().find_map(|effect| {
        let uneven = effect.relations.uneven_of?;
        let constant = uneven.with.iter().find_map(|constant| place(constant))?;
        Some((place(uneven.even)?, constant, *effect))
    })
}

/// What a set is: names and how many parameters are free.
fn identity(set: &Set) -> Vec<(&'static str, usize)> {
    let items = set.hypothesis.items.iter();
    let mut key: Vec<_> = items.map(|it| (it.effect.name, it.size())).collect();
    key.sort_unstable();
    key
}
