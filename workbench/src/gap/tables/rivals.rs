//! What else would explain the table: each accepted effect is replaced by every other one, and what fits as well is a tie.

use super::candidates::{Form, forms};
use super::fit::Fit;
use super::search::{Search, THRESHOLD, TIE};
use crate::system::effects::{Effect, MOTOR_GAIN, RESISTANCE, VISCOUS_FRICTION};
use rayon::prelude::*;

/// Parameters of the motor that can imitate a gain only together; damping, which a data sheet knows least, first.
static PAIRS: [[&Effect; 2]; 3] = [
    [&MOTOR_GAIN, &VISCOUS_FRICTION],
    [&MOTOR_GAIN, &RESISTANCE],
    [&RESISTANCE, &VISCOUS_FRICTION],
];

/// A set in which one accepted effect is replaced.
#[derive(Clone, Debug)]
pub struct Replacement {
    /// What stands in its place.
    pub effects: Vec<&'static Effect>,
    /// The refitted set.
    pub fit: Fit,
    /// Score above that of the accepted set; negative: better.
    pub worse_by: f64,
    /// A reason other than the score for which it is no rival.
    pub objection: Option<String>,
}

impl Replacement {
    /// Their names.
    pub fn names(&self) -> Vec<String> {
        self.effects.iter().map(|effect| effect.name.to_owned()).collect()
    }

    /// Whether the data cannot tell it from the accepted effect.
    pub fn ties(&self, inflation: f64) -> bool {
        self.objection.is_none() && self.worse_by < TIE * inflation
    }
}

impl Search<'_> {
    /// The accepted set with each effect in the form of its most plausible equal: of names that explain the table within
    /// one unit of score, the first in the library's order along the signal stands for all.
    pub fn canonical(&self, mut fit: Fit) -> Fit {
        for k in 0..fit.forms.len() {
            let chosen = fit.forms[k].effect;
            let earlier = self.offer.effects().into_iter().take_while(|e| *e != chosen);
            let equal = earlier
                .flat_map(forms)
                .filter(|f| f.size() <= fit.forms[k].size())
                .find_map(|form| {
                    let other = self.substituted(&fit, k, &form)?;
                    (self.score(&other) < self.score(&fit) + 1.0).then_some(other)
                });
            if let Some(other) = equal {
                fit = reordered(other, k);
            }
        }
        fit
    }

    /// Every replacement of effect k, the best first.
    pub fn replacements(&self, fit: &Fit, k: usize) -> Vec<Replacement> {
        let mut others = self.offer.effects();
        others.retain(|effect| *effect != fit.forms[k].effect);
        let mut all: Vec<Replacement> = others
            .into_par_iter()
            .filter_map(|e| self.replacement(fit, k, e))
            .collect();
        if fit.forms[k].effect.is_scale() {
            all.extend(self.base_pairs(fit, k, &all));
        }
        all.sort_by(|a, b| a.worse_by.total_cmp(&b.worse_by));
        all
    }

    fn replacement(&self, fit: &Fit, k: usize, effect: &'static Effect) -> Option<Replacement> {
        let fits = forms(effect)
            .into_iter()
            .flat_map(|form| self.exchanged(fit, k, &[form]));
        let best = fits.min_by(|a, b| self.score(a).total_cmp(&self.score(b)))?;
        Some(self.compared(fit, vec![effect], best))
    }

    fn compared(&self, accepted: &Fit, effects: Vec<&'static Effect>, fit: Fit) -> Replacement {
        let worse_by = self.score(&fit) - self.score(accepted);
        Replacement {
            effects,
            fit,
            worse_by,
            objection: None,
        }
    }

    /// Two motor parameters in the place of a gain, if no single one can take it. All pairs that fit are one family, since a
    /// steady speed sees only the motor constant and the product of resistance and damping: the first of [`PAIRS`] stands
    /// for it.
    fn base_pairs(&self, fit: &Fit, k: usize, singles: &[Replacement]) -> Vec<Replacement> {
        let inflation = self.inflation(fit);
        let base = |r: &&Replacement| r.effects[0].is_base_parameter();
        if singles.iter().filter(base).any(|r| r.ties(inflation)) {
            return vec![];
        }
        let mut pairs: Vec<Replacement> = PAIRS.iter().filter_map(|pair| self.pair(fit, k, *pair)).collect();
        let mut fitting = pairs.iter_mut().filter(|p| p.ties(inflation));
        if let Some(first) = fitting.next() {
            let stands = first.names().join(" + ");
            fitting.for_each(|p| {
                p.objection = Some(format!("the same as {stands}: only the product R·b is seen"))
            });
        }
        pairs
    }

    fn pair(&self, fit: &Fit, k: usize, pair: [&'static Effect; 2]) -> Option<Replacement> {
        let offered = self.offer.effects();
        if !pair.iter().all(|effect| offered.contains(effect)) {
            return None;
        }
        let fits = self.exchanged(fit, k, &pair.map(Form::free));
        let best = fits
            .into_iter()
            .min_by(|a, b| self.score(a).total_cmp(&self.score(b)))?;
        Some(self.compared(fit, pair.to_vec(), best))
    }

    /// Effect k exchanged for others: once with the rest where it was, once grown anew, because a gain that moves to
    /// another place of the chain moves every threshold behind it.
    fn exchanged(&self, fit: &Fit, k: usize, new: &[Form]) -> Vec<Fit> {
        let rest = self.others(fit, k);
        let allowed = |parent: &Fit, form: &Form| self.compatible(parent, form.effect);
        let extend = |parent: Option<Fit>, form: &Form| {
            parent
                .filter(|p| allowed(p, form))
                .and_then(|p| self.extended(&p, form))
        };
        let warm = new.iter().fold(Some(rest.clone()), extend);
        // Only a gain does that; other exchanges leave the thresholds where they are.
        let moves = fit.forms[k].effect.is_scale();
        let cold = moves
            .then(|| new.iter().chain(&rest.forms).fold(self.nothing(), extend))
            .flatten();
        warm.into_iter().chain(cold).collect()
    }

    /// Effects that are not in the set, each added to it; the one that would help most first.
    pub fn additions(&self, fit: &Fit) -> Vec<Replacement> {
        let offered = self
            .offer
            .effects()
            .into_iter()
            .filter(|e| self.compatible(fit, e));
        let added = offered.filter_map(|e| {
            let fits = forms(e).into_iter().filter_map(|form| self.extended(fit, &form));
            let best = fits.min_by(|a, b| self.score(a).total_cmp(&self.score(b)))?;
            Some(self.compared(fit, vec![e], best))
        });
        let mut all: Vec<Replacement> = added.collect();
        for r in &mut all {
            r.objection = Some(match -r.worse_by {
                gain if gain > 0.5 => {
                    format!("added, it earns {gain:.0} of the {THRESHOLD:.0} points that a name needs")
                }
                _ => "added, it explains nothing more".into(),
            });
        }
        all.sort_by(|a, b| a.worse_by.total_cmp(&b.worse_by));
        all
    }
}

/// Moves the last effect of a set to place k.
fn reordered(fit: Fit, k: usize) -> Fit {
    let last = fit.forms.len() - 1;
    let size = fit.size();
    let own = fit.forms[last].size();
    let start: usize = fit.forms[..k].iter().map(Form::size).sum();
    let mut x = fit.x.clone();
    x[start..size].rotate_right(own);
    let mut forms = fit.forms.clone();
    forms[k..].rotate_right(1);
    Fit { forms, x, ..fit }
}
