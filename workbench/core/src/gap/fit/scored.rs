//! A fitted set and its score.

use crate::gap::dataset::{Dataset, FINE, GridRun, Part};
use crate::gap::fit::hypothesis::{Data, Hypothesis, Item};
use crate::gap::fit::problem::{Problem, dot};
use crate::gap::fit::{Evaluator, FINAL, Fit, SEARCH, Setting, fit, fitted, solver};
use crate::system::model::Model;
use crate::system::plant::physics::Physics;
use std::borrow::BorrowMut;

/// A fitted set.
#[derive(Clone, Debug)]
pub struct Scored<'a, D = Dataset> {
    /// The set.
    pub hypothesis: Hypothesis<'a, D>,
    /// Its fit.
    pub fit: Fit,
    /// Cost and penalty for its parameters: lower is better.
    pub score: f64,
}

impl<D: Data> Scored<'_, D> {
    /// Some of the effects in another order, not fitted again.
    pub fn arranged(&self, items: Vec<Item>) -> Self {
        let hypothesis = self.hypothesis.with(items);
        let x = hypothesis.carried(&self.hypothesis, &self.fit.x, &|_| 0.0);
        Self { hypothesis, fit: Fit { x, ..self.fit.clone() }, score: self.score }
    }

    /// The set without one effect, not fitted again.
    pub fn lacking(&self, index: usize) -> Self {
        let others = self.hypothesis.items.iter().enumerate().filter(|(k, _)| *k != index);
        self.arranged(others.map(|(_, item)| *item).collect())
    }

    /// The effects' names with plus signs.
    pub fn label(&self) -> String {
        if self.hypothesis.items.is_empty() {
            "the model as given".into()
        } else {
            self.hypothesis.names().join(" + ")
        }
    }

    /// The plant that was fitted.
    pub fn plant(&self) -> Physics {
        self.hypothesis.plant(&self.fit.x)
    }
}

impl<'a> Scored<'a> {
    /// The model as given, not fitted: its cost is not asked for.
    pub fn given(dataset: &'a Dataset, model: &'a Model) -> Self {
        let hypothesis = Hypothesis::new(dataset, model, Vec::new());
        let x = vec![0.0; hypothesis.slots.len()];
        Self { hypothesis, fit: Fit { x, cost: f64::NAN, chi2: f64::NAN, samples: 0 }, score: f64::NAN }
    }

    /// A hypothesis fitted from some numbers, without a penalty.
    pub fn fitted(hypothesis: Hypothesis<'a>, x: &[f64], setting: &Setting) -> Self {
        let fit = fit(&hypothesis, x, setting);
        Self { score: fit.cost, hypothesis, fit }
    }

    /// The same set fitted again, from its own numbers.
    pub fn refitted(&self, setting: &Setting) -> Self {
        Self::fitted(self.hypothesis.clone(), &self.fit.x, setting)
    }

    /// Goes on to where the priors are least strained: [`solver::settled`].
    pub fn settle(&mut self) {
        let mut evaluator = Evaluator::new(&self.hypothesis, &FINAL);
        let solution = solver::settled(&mut evaluator, &self.fit.x, &FINAL.schedule());
        self.fit = fitted(&self.hypothesis, solution);
    }

    /// The set with some of its effects, fitted anew.
    pub fn only(&self, keep: impl Fn(usize) -> bool, setting: &Setting) -> Self {
        let (hypothesis, x) = self.hypothesis.only(&self.fit.x, keep);
        Self::fitted(hypothesis, &x, setting)
    }

    /// Sums of squared residuals of each held-out record, in the order of the records: what a person sees of a prediction, without
    /// weights. Where no record was given, the held-out part of the log is the one.
    pub fn held_out(&self) -> Vec<f64> {
        let mut sums = std::collections::BTreeMap::new();
        let held_out = |run: &GridRun| run.speed.part.contains(&Part::HoldOut);
        self.hypothesis.simulated_some(&self.fit.x, &self.plant(), held_out, |index, _, predicted| {
            let run = &self.hypothesis.dataset.runs[index];
            let held_out = (0..predicted.len()).filter(|k| run.speed.part[*k] == Part::HoldOut);
            let square = |k: usize| (run.speed.measured[k] - predicted[k]).powi(2);
            *sums.entry(run.log).or_insert(0.0) += held_out.map(square).sum::<f64>();
        });
        // A simulation that ran away is as wrong as can be.
        sums.into_values().map(|sum: f64| if sum.is_nan() { f64::INFINITY } else { sum }).collect()
    }
}

/// χ² per sample beyond 1, times the inflation of a mean's variance by the residual's correlation.
pub fn dispersion(scored: &Scored) -> f64 {
    dispersion_on(scored, &SEARCH)
}

/// The same on a grid.
pub fn dispersion_on(scored: &Scored, setting: &Setting) -> f64 {
    let residuals = compared(&scored.hypothesis, &scored.fit.x, setting);
    let mean_square = dot(&residuals, &residuals) / residuals.len() as f64;
    mean_square.max(1.0) * crate::gap::residual::inflation(&residuals)
}

/// What a set pays for its parameters (Schwarz, Annals of Statistics 6, 1978).
fn penalty(hypothesis: &Hypothesis, samples: usize) -> f64 {
    (2.0 * samples as f64).ln() * hypothesis.effect_slots() as f64
}

/// The score of a set, its penalty measured by another set's dispersion.
pub fn score_with(scored: &Scored, factor: f64) -> f64 {
    scored.fit.cost + factor * penalty(&scored.hypothesis, scored.fit.samples)
}

/// Sorts sets by score, best first, the penalty measured by the dispersion of the set that fits best: with the
/// dispersion of a set that lacks an effect, a second parameter could never pay.
pub fn rank<'a, T: BorrowMut<Scored<'a>>>(sets: &mut [T]) {
    let costs = |set: &T| set.borrow().fit.cost;
    let Some(nearest) = sets.iter().min_by(|a, b| costs(a).total_cmp(&costs(b))) else {
        return;
    };
    let factor = dispersion(nearest.borrow());
    for scored in sets.iter_mut().map(BorrowMut::borrow_mut) {
        scored.score = score_with(scored, factor);
    }
    sets.sort_by(|a, b| a.borrow().score.total_cmp(&b.borrow().score));
}

/// χ² and number of samples of a hypothesis on the parts of a setting.
pub fn chi2(hypothesis: &Hypothesis, x: &[f64], setting: &Setting) -> (f64, usize) {
    let residuals = compared(hypothesis, x, setting);
    (dot(&residuals, &residuals), residuals.len())
}

/// The residuals of the compared samples, without the priors.
pub fn compared(hypothesis: &Hypothesis, x: &[f64], setting: &Setting) -> Vec<f64> {
    let mut residuals = Vec::new();
    Evaluator::new(hypothesis, setting).residuals(x, &mut residuals);
    residuals.truncate(residuals.len() - hypothesis.priors(x).count());
    residuals
}

/// The residual on the held-out part, unweighted by anything but the noise.
pub const HELD_OUT: Setting = Setting { parts: &[Part::HoldOut], finest: FINE, iterations: 0 };
