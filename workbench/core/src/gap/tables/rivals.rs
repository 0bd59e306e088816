//! What else would explain the table: each accepted effect is replaced by every other one, and what fits as well is a tie.

use super::candidates::forms;
use super::fit::Set;
use super::search::best;
use super::sets::Search;
use crate::gap::acceptance::tied;
use crate::gap::fit::hypothesis::Item;
use crate::gap::order::by_least;
use crate::system::effects::{Effect, MOTOR_GAIN, RESISTANCE, VISCOUS_FRICTION};
use crate::system::threads::*;

/// Parameters of the motor that can imitate a gain only together; damping, which a data sheet knows least, first.
static PAIRS: [[&Effect; 2]; 3] =
    [[&MOTOR_GAIN, &VISCOUS_FRICTION], [&MOTOR_GAIN, &RESISTANCE], [&RESISTANCE, &VISCOUS_FRICTION]];

/// A set in which one accepted effect is replaced.
#[derive(Clone)]
pub struct Replacement<'a> {
    /// What stands in its place.
    pub effects: Vec<&'static Effect>,
    /// The refitted set.
    pub set: Set<'a>,
    /// Score above that of the accepted set; negative: better.
    pub worse_by: f64,
    /// A reason other than the score for which it is no rival.
    pub objection: Option<String>,
}

impl Replacement<'_> {
    /// Their names.
    pub fn names(&self) -> Vec<String> {
        self.effects.iter().map(|effect| effect.name.to_owned()).collect()
    }

    /// True if the data cannot tell it from the accepted effect.
    pub fn ties(&self, inflation: f64) -> bool {
        self.objection.is_none() && self.worse_by < tied(inflation)
    }
}

impl<'a> Search<'a> {
    /// The accepted set with each effect in the form of its most plausible equal: of names that explain the table within
    /// one unit of score, the first in the library's order along the signal stands for all.
    pub fn canonical(&self, mut set: Set<'a>) -> Set<'a> {
        for k in 0..set.hypothesis.items.len() {
            let chosen = set.hypothesis.items[k];
            let earlier = self.offer.effects().into_iter().take_while(|e| *e != chosen.effect);
            let simple = earlier.flat_map(forms).filter(|it| it.size() <= chosen.size());
            let mut equals = simple
                .filter_map(|item| self.substituted(&set, k, &item))
                .filter(|other| other.score < set.score + 1.0);
            if let Some(other) = equals.next() {
                let mut items = other.hypothesis.items.clone();
                items[k..].rotate_right(1);
                set = other.arranged(items);
            }
        }
        set
    }

    /// Every replacement of effect k, the best first.
    pub fn replacements(&self, set: &Set<'a>, k: usize) -> Vec<Replacement<'a>> {
        let replaced = set.hypothesis.items[k].effect;
        let mut others = self.offer.effects();
        others.retain(|effect| *effect != replaced);
        let mut all: Vec<Replacement<'a>> =
            each(others).filter_map(|effect| self.replacement(set, k, effect)).collect();
        if replaced.is_scale() {
            all.extend(self.base_pairs(set, k, &all));
        }
        by_least(&mut all, |it| it.worse_by);
        all
    }

    fn replacement(&self, set: &Set<'a>, k: usize, effect: &'static Effect) -> Option<Replacement<'a>> {
        let items = forms(effect).into_iter();
        let other = best(items.flat_map(|item| self.exchanged(set, k, &[item])))?;
        let replaced = compared(set, vec![effect], other);
        // Two sides hold equal ones: which of the forms the rows support was decided by the score.
        let forms = one_form(effect, set.hypothesis.items[k].effect);
        let objection =
            forms.then(|| "the same with another number of sides: these rows do not ask for it".into());
        Some(Replacement { objection, ..replaced })
    }

    /// Two motor parameters in the place of a gain, if no single one can take it. All pairs that fit are one family, since a
    /// steady speed sees only the motor constant and the product of resistance and damping: the first of [`PAIRS`] stands
    /// for it.
    fn base_pairs(&self, set: &Set<'a>, k: usize, singles: &[Replacement<'a>]) -> Vec<Replacement<'a>> {
        let inflation = set.inflation();
        let base = |r: &&Replacement| r.effects[0].is_base_parameter();
        if singles.iter().filter(base).any(|r| r.ties(inflation)) {
            return vec![];
        }
        let pairs = PAIRS.iter().filter_map(|pair| self.pair(set, k, *pair));
        let mut pairs: Vec<Replacement<'a>> = pairs.collect();
        let mut fitting = pairs.iter_mut().filter(|p| p.ties(inflation));
        if let Some(first) = fitting.next() {
            let stands = first.names().join(" + ");
            fitting.for_each(|p| {
                p.objection = Some(format!("the same as {stands}: only the product R·b is seen"))
            });
        }
        pairs
    }

    fn pair(&self, set: &Set<'a>, k: usize, pair: [&'static Effect; 2]) -> Option<Replacement<'a>> {
        let offered = self.offer.effects();
        if !pair.iter().all(|effect| offered.contains(effect)) {
            return None;
        }
        let other = best(self.exchanged(set, k, &pair.map(Item::full)))?;
        Some(compared(set, pair.to_vec(), other))
    }

    /// Effect k exchanged for others: once with the rest where it was, once grown anew, because a gain that moves to
    /// another place of the chain moves every threshold behind it.
    fn exchanged(&self, set: &Set<'a>, k: usize, new: &[Item]) -> Vec<Set<'a>> {
        let rest = set.lacking(k);
        let extend = |parent: Option<Set<'a>>, item: &Item| {
            let parent = parent.filter(|parent| self.compatible(parent, item.effect))?;
            self.extended(&parent, item)
        };
        let warm = new.iter().fold(Some(rest.clone()), extend);
        // Only a gain does that; other exchanges leave the thresholds where they are.
        let moves = set.hypothesis.items[k].effect.is_scale();
        let all = || new.iter().chain(&rest.hypothesis.items);
        let cold = moves.then(|| all().fold(self.nothing(), extend)).flatten();
        warm.into_iter().chain(cold).collect()
    }
}

fn compared<'a>(accepted: &Set, effects: Vec<&'static Effect>, set: Set<'a>) -> Replacement<'a> {
    Replacement { worse_by: set.score - accepted.score, effects, set, objection: None }
}

/// True if one of two effects is the other with two different sides.
fn one_form(a: &Effect, b: &Effect) -> bool {
    let even =
        |uneven: &Effect, even: &Effect| uneven.relations.uneven_of.is_some_and(|uneven| uneven.even == even);
    even(a, b) || even(b, a)
}
