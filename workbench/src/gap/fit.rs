//! Fitting one hypothesis by simulation error: least squares on the free-run residual and on the priors.
//!
//! Derivatives are taken on a coarse grid, and those of the nuisances follow the steps: see [`super::solver`].

use crate::gap::dataset::{Part, Probes, Simulation};
use crate::gap::hypothesis::{Hypothesis, Slot};
use crate::gap::solver::{self, Problem, Schedule, Solution, solve, solve_near};
use crate::system::plant::physics::Physics;
use nalgebra::DMatrix;

/// Longest step of the simulation in the search, as a part of the time constant.
pub const COARSE: f64 = 1.0 / 45.0;
/// Longest step of the simulation in the final fits, as a part of the time constant.
pub const FINE: f64 = 1.0 / 180.0;

/// A step that lowers the cost by less than this part of it is slow.
const SLOW: f64 = 1e-4;
/// A step that promises less χ² than this, times the cost per sample, is not taken: no name depends on it.
const NEGLIGIBLE: f64 = 0.02;

/// What a fit compares, and how finely it simulates.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// The parts that count.
    pub parts: &'static [Part],
    /// Longest step.
    pub finest: f64,
    /// Most iterations.
    pub iterations: usize,
}

/// Both folds, coarse: the search.
pub const SEARCH: Setting = Setting { parts: &[Part::A, Part::B], finest: COARSE, iterations: 12 };
/// Both folds, fine: the result.
pub const FINAL: Setting = Setting { parts: &[Part::A, Part::B], finest: FINE, iterations: 5 };

/// A fitted hypothesis.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The numbers.
    pub x: Vec<f64>,
    /// Squared weighted residuals and priors.
    pub cost: f64,
    /// Squared weighted residuals alone.
    pub chi2: f64,
    /// Number of compared samples, speed and current together.
    pub samples: usize,
}

/// Residuals of one evaluation: the compared samples first, the priors last.
pub struct Evaluator<'h, 'a> {
    hypothesis: &'h Hypothesis<'a>,
    parts: &'static [Part],
    finest: f64,
    simulation: Simulation,
}

impl<'h, 'a> Evaluator<'h, 'a> {
    /// For a hypothesis.
    pub fn new(hypothesis: &'h Hypothesis<'a>, setting: &Setting) -> Self {
        Self { hypothesis, parts: setting.parts, finest: setting.finest, simulation: Simulation::default() }
    }

    /// Weighted residuals and priors.
    fn compared(&mut self, x: &[f64], finest: f64, out: &mut Vec<f64>) {
        let plant = self.hypothesis.plant(x);
        self.simulated(&plant, x, finest, out);
    }

    /// Weighted residuals of another plant than that of the numbers, and their priors.
    pub fn of_plant(&mut self, plant: &Physics, x: &[f64], out: &mut Vec<f64>) {
        self.simulated(plant, x, self.finest, out);
    }

    fn simulated(&mut self, plant: &Physics, x: &[f64], finest: f64, out: &mut Vec<f64>) {
        out.clear();
        let only_holdout = self.parts == [Part::HoldOut];
        for (index, run) in self.hypothesis.dataset.runs.iter().enumerate() {
            if run.log > 0 && !only_holdout {
                continue;
            }
            let start = self.hypothesis.start_speed(index, x);
            let (_, predicted) = self.simulation.speed(run, plant, start, finest);
            compare(self.parts, &run.speed, predicted, out);
            if !run.current.is_empty() {
                compare(self.parts, &run.current, self.simulation.current(run), out);
            }
        }
        out.extend(self.hypothesis.priors(x));
        // A simulation that ran away must lose, not poison the sums.
        out.iter_mut().filter(|r| r.is_nan() || r.abs() > 1e6).for_each(|r| *r = 1e6);
    }
}

/// The weighted residuals of the parts that count.
fn compare(parts: &[Part], probes: &Probes, predicted: &[f64], out: &mut Vec<f64>) {
    let samples = predicted.iter().enumerate();
    let counted = samples.filter(|(k, _)| parts.contains(&probes.part[*k]));
    out.extend(counted.map(|(k, predicted)| (probes.measured[k] - predicted) * probes.weight[k]));
}

impl Problem for Evaluator<'_, '_> {
    fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>) {
        self.compared(x, self.finest, out);
    }

    fn probed(&mut self, x: &[f64], out: &mut Vec<f64>) {
        self.compared(x, COARSE, out);
    }

    fn probes_alike(&self) -> bool {
        self.finest == COARSE
    }

    fn bounds(&self, slot: usize) -> (f64, f64) {
        self.hypothesis.bounds(slot)
    }

    fn step(&self, slot: usize) -> f64 {
        self.hypothesis.step(slot)
    }

    /// The base and the start speeds bend little.
    fn bending(&self) -> usize {
        self.hypothesis.effect_slots()
    }
}

impl Setting {
    fn schedule(&self) -> Schedule {
        Schedule { iterations: self.iterations, slow: SLOW, negligible: NEGLIGIBLE }
    }
}

/// Fits a hypothesis from a start.
pub fn fit(hypothesis: &Hypothesis, start: &[f64], setting: &Setting) -> Fit {
    let mut evaluator = Evaluator::new(hypothesis, setting);
    fitted(hypothesis, solve(&mut evaluator, start, &setting.schedule()))
}

/// Fits a hypothesis near another one, whose derivatives with respect to the nuisances are known.
pub fn fit_near(
    hypothesis: &Hypothesis,
    start: &[f64],
    setting: &Setting,
    known: &dyn Fn(&Slot) -> Option<Vec<f64>>,
) -> Fit {
    let mut evaluator = Evaluator::new(hypothesis, setting);
    let slots = hypothesis.slots.iter();
    let columns = slots.map(|slot| known(slot).unwrap_or_default()).collect();
    let solution = solve_near(&mut evaluator, start, &setting.schedule(), columns);
    fitted(hypothesis, solution)
}

fn fitted(hypothesis: &Hypothesis, solution: Solution) -> Fit {
    let priors: f64 = hypothesis.priors(&solution.x).map(|z| z * z).sum();
    Fit {
        samples: solution.residuals.len() - hypothesis.priors(&solution.x).count(),
        chi2: solution.cost - priors,
        cost: solution.cost,
        x: solution.x,
    }
}

/// Covariance of the numbers at a fit, priors included; zero where it is singular.
pub fn covariance(hypothesis: &Hypothesis, fit: &Fit, setting: &Setting) -> DMatrix<f64> {
    let numbers = fit.x.len();
    let mut evaluator = Evaluator::new(hypothesis, setting);
    let found = solver::covariance(&mut evaluator, &fit.x, |_, information| 1e-12 * (1.0 + information));
    found.unwrap_or_else(|| DMatrix::zeros(numbers, numbers))
}
