//! Richer and poorer forms of the effects of a set.

use super::Search;
use super::race::looked_at;
use crate::gap::acceptance::noise::SHARE_OF_GAP;
use crate::gap::acceptance::price;
use crate::gap::fit::hypothesis::{Hypothesis, Item, Slot};
use crate::gap::fit::scored::{Scored, dispersion};
use crate::gap::fit::{FINAL, SEARCH, fit};
use crate::outcome::DEVIATIONS;
use crate::system::effects::{Effect, Family, LIBRARY};
use crate::system::threads::*;

/// Two sides are called different where their difference is more than this part of their mean. Origin: hidden cases
/// draw a sixth and more, and nobody would put less into a machine.
const EVEN: f64 = 0.03;
/// Starts of an optional parameter, a softness, that the grid of its effect does not move. Chosen by judgement; not
/// studied.
const SMALL: [f64; 2] = [0.03, 0.2];

impl<'a> Search<'a, '_> {
    /// Tries the richer and the poorer forms of each effect (a softness, two sides instead of one).
    pub(super) fn refined(&self, scored: Scored<'a>) -> Scored<'a> {
        let mut best = self.scored(scored.hypothesis, scored.fit);
        let mut next = 0;
        // All effects at once; those behind one that took another form once more.
        while let Some((index, better)) = self.reformed(&best, next) {
            (best, next) = (better, index + 1);
        }
        best
    }

    /// The set with the first effect, from a place on, that is better in another form, and that effect's place.
    fn reformed(&self, set: &Scored<'a>, from: usize) -> Option<(usize, Scored<'a>)> {
        let tried: Vec<(usize, Scored<'a>)> = each(self.forms_of(set, from))
            .filter_map(|(index, item)| Some((index, self.replaced(set, index, item)?)))
            .collect();
        let mut best: Option<(usize, Scored<'a>)> = None;
        for (index, other) in tried {
            let (found, than) = best.as_ref().map_or((index, set), |(found, better)| (*found, better));
            let more = other.hypothesis.effect_slots() > than.hypothesis.effect_slots();
            let margin = if more { price(self.dispersion.min(dispersion(&other))) } else { 0.0 };
            if index == found && other.score + margin < than.score {
                best = Some((index, other));
            }
        }
        best
    }

    /// Other forms of the effects of a set from a place on, with their places.
    pub(super) fn forms_of(&self, set: &Scored<'a>, from: usize) -> Vec<(usize, Item)> {
        let variants = |index| self.variants(&set.hypothesis, index).into_iter().map(move |it| (index, it));
        (from..set.hypothesis.items.len()).flat_map(variants).collect()
    }

    pub(super) fn variants(&self, hypothesis: &Hypothesis<'a>, index: usize) -> Vec<Item> {
        let item = hypothesis.items[index];
        let mut variants = Vec::new();
        if !item.is_full() && item.effect.parameters.iter().any(|it| it.default.is_some()) {
            variants.push(Item::full(item.effect));
        }
        // Poorer and richer forms of one thing: a fit with one starts a fit with another.
        if matches!(item.effect.family, Family::DeadZone | Family::DryFriction | Family::Viscous) {
            let library = LIBRARY.iter().copied();
            let twins = library.filter(|other| other.same_family(item.effect) && *other != item.effect);
            let allowed = twins.filter(|other| self.offers_form(other.form) && !self.excludes(other));
            variants.extend(allowed.map(Item::plain));
        }
        variants
    }

    /// The set with the symmetric form in the place of every form whose two sides turned out equal or cannot be told apart, finely
    /// fitted.
    pub(super) fn evened(&self, scored: Scored<'a>) -> Scored<'a> {
        let mut best = scored;
        for index in 0..best.hypothesis.items.len() {
            if let Some((even, alike)) = self.even(&best, index) {
                let untold = DEVIATIONS * DEVIATIONS * dispersion(&best);
                let much = if alike { untold.max(SHARE_OF_GAP * self.first_gap) } else { untold };
                best = if even.fit.cost - best.fit.cost < much { even } else { best };
            }
        }
        best
    }

    /// The symmetric form of an effect with two sides, from their mean, and whether they are nearly equal.
    fn even(&self, scored: &Scored<'a>, index: usize) -> Option<(Scored<'a>, bool)> {
        let uneven = scored.hypothesis.items[index];
        let form = uneven.effect.relations.uneven_of?.even;
        let side = |side: usize| scored.hypothesis.slot(index, side).map(|slot| scored.fit.x[slot]);
        let (one, other) = (side(0)?, side(1)?);
        let mean = 0.5 * (one + other);
        if self.excludes(form) {
            return None;
        }
        let even = if uneven.is_full() { Item::full(form) } else { Item::plain(form) };
        let hypothesis = scored.hypothesis.with_item(index, even);
        // What follows the two sides is a softness, which the symmetric form has as well.
        let from_sides = |slot: &Slot| match slot {
            Slot::Effect { parameter: 0, .. } => mean,
            Slot::Effect { parameter, .. } => side(parameter + 1).unwrap_or(0.0),
            _ => 0.0,
        };
        let x = hypothesis.carried(&scored.hypothesis, &scored.fit.x, &from_sides);
        let even = self.priced(Scored::fitted(hypothesis, &x, &FINAL));
        Some((even, (one - other).abs() <= EVEN * mean.abs()))
    }

    /// The same set with one effect in another form.
    pub(super) fn replaced(&self, scored: &Scored<'a>, index: usize, item: Item) -> Option<Scored<'a>> {
        let hypothesis = scored.hypothesis.with_item(index, item);
        if item.effect == scored.hypothesis.items[index].effect {
            let fits = of_each(richer(item.effect), |start| {
                let default = |slot: &Slot| match slot {
                    Slot::Effect { parameter, .. } => start[*parameter],
                    _ => 0.0,
                };
                fit(&hypothesis, &hypothesis.carried(&scored.hypothesis, &scored.fit.x, &default), &SEARCH)
            });
            let best = fits.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))?;
            return Some(self.scored(hypothesis, best));
        }
        // The numbers that the other form has bent may lead astray: the fit also starts where they are without it.
        let parents = [scored.lacking(index), self.without(scored, index, &SEARCH)];
        let children = of_each(&parents, |parent| {
            let (basis, projector) = looked_at(parent);
            self.child(parent, &basis, &projector, item.effect)
        });
        let child = children.into_iter().flatten().min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))?;
        // Back to the order of naming.
        Some(child.arranged(hypothesis.items))
    }
}

/// Starts of an effect's optional parameters, at the places of all its parameters: those of its own grid, or small ones.
fn richer(effect: &Effect) -> Vec<Vec<f64>> {
    let optional = |k: usize| effect.parameters[k].default.is_some();
    let mut all: Vec<Vec<f64>> = Vec::new();
    for row in effect.starts.rows().iter().filter(|row| effect.moves_option(row)) {
        let tail: Vec<f64> = (0..row.len()).map(|k| if optional(k) { row[k] } else { 0.0 }).collect();
        if !all.contains(&tail) {
            all.push(tail);
        }
    }
    if all.is_empty() {
        all = SMALL.map(|value| vec![value; effect.parameters.len()]).into();
    }
    all
}
