//! Sets made from other sets: one effect more, one less, one in the place of another, each fitted anew.

use super::candidates::{Offer, same_place};
use super::fit::{Set, best, mean_square};
use super::rows::Rows;
use crate::gap::fit::Fit;
use crate::gap::fit::hypothesis::{Hypothesis, Item, Slot};
use crate::gap::order::by_least;
use crate::system::effects::Effect;
use crate::system::model::Model;

/// Starts that are worth a descent. A budget of computing time, chosen by judgement.
const DESCENTS: usize = 4;

/// The search for one table.
#[derive(Clone, Copy)]
pub struct Search<'a> {
    /// What is fitted.
    pub rows: &'a Rows,
    /// The model as given.
    pub model: &'a Model,
    /// Candidates.
    pub offer: &'a Offer<'a>,
}

impl<'a> Search<'a> {
    pub(super) fn hypothesis(&self, items: Vec<Item>) -> Hypothesis<'a, Rows> {
        Hypothesis::new(self.rows, self.model, items)
    }

    /// A fitted set with its score, n·ln(mean square) + Σ(δ/tolerance)² + k·ln n; the lower the better.
    pub(super) fn scored(&self, hypothesis: Hypothesis<'a, Rows>, fit: Fit) -> Set<'a> {
        let price = (fit.samples as f64).ln() * hypothesis.effect_slots() as f64;
        Set { score: fit.cost + price, hypothesis, fit }
    }

    /// The model as given, its base refitted within tolerance.
    pub fn nothing(&self) -> Option<Set<'a>> {
        let hypothesis = self.hypothesis(vec![]);
        let start = vec![0.0; hypothesis.slots.len()];
        self.fitted(hypothesis, vec![start])
    }

    /// A set fitted to the rows of this search, from its own numbers.
    pub fn again(&self, set: &Set) -> Option<Set<'a>> {
        let hypothesis = self.hypothesis(set.hypothesis.items.clone());
        self.fitted(hypothesis, vec![set.fit.x.clone()])
    }

    /// Fits a set from the most promising of these starts.
    pub fn fitted(&self, hypothesis: Hypothesis<'a, Rows>, mut starts: Vec<Vec<f64>>) -> Option<Set<'a>> {
        if starts.len() > DESCENTS {
            let misfit = |x: Vec<f64>| (mean_square(&hypothesis, &x), x);
            let mut promising: Vec<(f64, Vec<f64>)> = starts.into_iter().map(misfit).collect();
            by_least(&mut promising, |it| it.0);
            starts = promising.into_iter().take(DESCENTS).map(|it| it.1).collect();
        }
        let fit = best(&hypothesis, &starts)?;
        Some(self.scored(hypothesis, fit))
    }

    /// True if an effect may be added to a set.
    pub fn compatible(&self, parent: &Set, effect: &Effect) -> bool {
        let clash = |it: &Item| same_place(it.effect, effect) || it.effect.excludes_in_tables(effect);
        !parent.hypothesis.items.iter().any(clash)
    }

    /// The set with one more effect, refitted: with the base where it was, and from its nominal values.
    pub fn extended(&self, parent: &Set<'a>, item: &Item) -> Option<Set<'a>> {
        self.extended_from(parent, item, &self.rows.starts(item, &parent.plant()), true)
    }

    /// The set with one more effect, refitted from these values of its parameters.
    pub fn extended_from(
        &self,
        parent: &Set<'a>,
        item: &Item,
        values: &[Vec<f64>],
        from_nominal: bool,
    ) -> Option<Set<'a>> {
        let hypothesis = parent.hypothesis.with_more(*item);
        let mut starts = Vec::new();
        for values in values {
            let own = |slot: &Slot| match slot {
                Slot::Effect { parameter, .. } => values[*parameter],
                _ => 0.0,
            };
            let x = hypothesis.carried(&parent.hypothesis, &parent.fit.x, &own);
            let nominal = from_nominal.then(|| nominal(&hypothesis, &x));
            starts.extend([x].into_iter().chain(nominal));
        }
        self.fitted(hypothesis, starts)
    }

    /// The set without effect k, refitted.
    pub fn without(&self, set: &Set<'a>, k: usize) -> Option<Set<'a>> {
        let others = set.lacking(k);
        let starts = vec![others.fit.x.clone(), nominal(&others.hypothesis, &others.fit.x)];
        self.fitted(others.hypothesis, starts)
    }

    /// The set with another form in the place of effect k, refitted.
    pub fn substituted(&self, set: &Set<'a>, k: usize, item: &Item) -> Option<Set<'a>> {
        let others = set.lacking(k);
        let allowed = self.compatible(&others, item.effect);
        allowed.then(|| self.extended(&others, item)).flatten()
    }
}

/// The numbers with the base at its nominal values.
fn nominal(hypothesis: &Hypothesis<Rows>, x: &[f64]) -> Vec<f64> {
    let slots = hypothesis.slots.iter().zip(x);
    slots.map(|(slot, x)| if slot.has_prior() { 0.0 } else { *x }).collect()
}
