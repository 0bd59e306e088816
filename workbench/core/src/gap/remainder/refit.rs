//! The table of a term fitted in free run, together with the numbers of the model.

use super::regression::{Dependence, bends};
use crate::gap::fit::hypothesis::Hypothesis;
use crate::gap::fit::problem::{Few, Problem, dot};
use crate::gap::fit::scored::Scored;
use crate::gap::fit::solver::{Schedule, covariance, solve};
use crate::gap::fit::{Evaluator, FINAL, Fit, SEARCH, Setting};
use crate::gap::residual::inflation;
use crate::system::model::{Model, UNNAMED, Unnamed};
use crate::system::plant::physics::Physics;
use crate::system::plant::unnamed::{Acting, Term};
use crate::system::threads::*;

/// Steps of the descent on the coarse grid and, from there, on the fine one. A budget of computing time, chosen by
/// judgement.
const STEPS: [usize; 2] = [8, 3];
/// Step of the derivative of a value, as a part of what the values are measured by. Chosen by judgement; not studied.
const STEP: f64 = 1e-3;
/// A value is bounded by this many times what the values are measured by. Chosen by judgement; not studied.
const MOST: f64 = 5.0;

/// A model with one more term, fitted.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model with the term.
    pub model: Model,
    /// The term's table.
    pub term: Term,
    /// Standard deviations of its values, once they were [measured](Self::measured).
    pub stds: Vec<f64>,
    /// The numbers of the hypothesis beside it.
    pub fit: Fit,
}

/// The table and the numbers of a hypothesis as one problem.
struct Together<'h, 'a> {
    hypothesis: &'h Hypothesis<'a>,
    evaluator: Evaluator<'h, 'a>,
    coarse: Evaluator<'h, 'a>,
    term: Term,
    /// What the values are measured by.
    unit: f64,
    /// Root of what a bend costs, in that unit.
    stiffness: f64,
    bends: Vec<[(usize, f64); 3]>,
}

impl<'h, 'a> Together<'h, 'a> {
    fn of(hypothesis: &'h Hypothesis<'a>, dependence: &Dependence, setting: &Setting) -> Self {
        let (scales, term) = (&hypothesis.dataset.scales, &dependence.candidate.term);
        let unit = match term.acts {
            Acting::Torque => scales.torque,
            Acting::Input => scales.input,
            Acting::Reading => 1.0,
        };
        Self {
            hypothesis,
            evaluator: Evaluator::new(hypothesis, setting),
            coarse: Evaluator::new(hypothesis, &SEARCH),
            stiffness: dependence.stiffness.sqrt() * unit,
            bends: bends(term),
            term: term.clone(),
            unit,
        }
    }

    fn plant(&self, x: &[f64]) -> Physics {
        let (values, numbers) = x.split_at(self.term.values.len());
        let mut plant = self.hypothesis.plant(numbers);
        let values = values.iter().map(|value| value * self.unit).collect();
        plant.unnamed.push(Term { values, ..self.term.clone() });
        plant
    }

    fn bent(&self, x: &[f64], out: &mut Vec<f64>) {
        let bend = |bend: &[(usize, f64); 3]| bend.iter().map(|(k, factor)| factor * x[*k]).sum::<f64>();
        out.extend(self.bends.iter().map(|it| self.stiffness * bend(it)));
    }
}

impl Problem for Together<'_, '_> {
    fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>) {
        let plant = self.plant(x);
        self.evaluator.of_plant(&plant, &x[self.term.values.len()..], out);
        self.bent(x, out);
    }

    fn probed_near(&mut self, _: &[f64], many: &[&[f64]], out: &mut [Vec<f64>]) {
        let this = &*self;
        each(many).zip(out).for_each(|(x, out)| {
            let plant = this.plant(x);
            this.coarse.of_plant(&plant, &x[this.term.values.len()..], out);
            this.bent(x, out);
        });
    }

    fn probes_alike(&self) -> bool {
        self.evaluator.probes_alike()
    }

    fn bounds(&self, slot: usize) -> (f64, f64) {
        match slot.checked_sub(self.term.values.len()) {
            None => (-MOST, MOST),
            Some(slot) => self.hypothesis.bounds(slot),
        }
    }

    fn step(&self, slot: usize) -> f64 {
        slot.checked_sub(self.term.values.len()).map_or(STEP, |slot| self.hypothesis.step(slot))
    }

    fn few(&self, slot: usize) -> Option<Few> {
        self.evaluator.few(slot.checked_sub(self.term.values.len())?)
    }

    /// A table bends little: the response to each of its values is almost that of the linear part.
    fn bending(&self) -> usize {
        0
    }
}

/// Fits the table of a dependence in free run.
pub fn fitted(scored: &Scored, dependence: &Dependence) -> Fitted {
    let hypothesis = &scored.hypothesis;
    let mut problem = Together::of(hypothesis, dependence, &SEARCH);
    let (unit, term) = (problem.unit, &dependence.candidate.term);
    let mut x: Vec<f64> = term.values.iter().map(|value| value / unit).collect();
    x.extend(&scored.fit.x);
    // A thousandth of the cost and a fiftieth of a residual are below what a reader sees of the share. Judgement; not studied.
    let schedule = |iterations| Schedule { iterations, slow: 1e-3, negligible: 0.02 };
    let mut solution = solve(&mut problem, &x, &schedule(STEPS[0]));
    problem = Together::of(hypothesis, dependence, &FINAL);
    solution = solve(&mut problem, &solution.x, &schedule(STEPS[1]));
    let (values, x) = solution.x.split_at(term.values.len());
    let term = Term { values: values.iter().map(|value| value * unit).collect(), ..term.clone() };
    let mut model = hypothesis.model.clone();
    let name = format!("{UNNAMED}{}", model.unnamed.len() + 1);
    model.unnamed.push(Unnamed { name, term: term.clone(), stds: None, origin: None });
    let samples = solution.residuals.len() - hypothesis.priors(x).count() - bends(&term).len();
    let compared = &solution.residuals[..samples];
    let fit = Fit { x: x.to_vec(), cost: solution.cost, chi2: dot(compared, compared), samples };
    Fitted { model, term, stds: Vec::new(), fit }
}

impl Fitted {
    /// The same with standard deviations: the residuals are neither as small as the noise nor independent of each other.
    pub fn measured(mut self, scored: &Scored, dependence: &Dependence) -> Self {
        let mut problem = Together::of(&scored.hypothesis, dependence, &FINAL);
        let unit = problem.unit;
        let values = self.term.values.iter().map(|value| value / unit);
        let (x, mut residuals) = (values.chain(self.fit.x.iter().copied()).collect::<Vec<f64>>(), Vec::new());
        problem.residuals(&x, &mut residuals);
        let compared = &residuals[..residuals.len() - problem.bends.len()];
        let factor = (dot(compared, compared) / compared.len() as f64).max(1.0) * inflation(compared);
        let found = covariance(&mut problem, &x, |_, information| 1e-9 * (1.0 + information));
        let variance = |k: usize| found.as_ref().map_or(f64::INFINITY, |found| found[(k, k)].max(0.0));
        self.stds = (0..self.term.values.len()).map(|k| unit * (variance(k) * factor).sqrt()).collect();
        self.model.unnamed.last_mut().expect("its own term").stds = Some(self.stds.clone());
        self
    }

    /// A set with the term, as a fitted hypothesis of the extended model.
    pub fn beside<'a>(&'a self, scored: &Scored<'a>) -> Scored<'a> {
        let items = scored.hypothesis.items.clone();
        let hypothesis = Hypothesis::new(scored.hypothesis.dataset, &self.model, items);
        Scored { hypothesis, fit: self.fit.clone(), score: self.fit.cost }
    }
}
