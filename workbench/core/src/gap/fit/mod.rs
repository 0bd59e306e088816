//! Fitting one hypothesis by simulation error: least squares on the free-run residual and on the priors.
//!
//! Derivatives are taken on a coarse grid, and those of the nuisances follow the steps: see [`solver`].

pub mod hypothesis;
pub mod initial_guesses;
pub mod jacobian;
pub mod problem;
pub mod samples;
pub mod scored;
pub mod solver;

use crate::gap::dataset::{COARSE, Compared, FINE, GridRun, Part, lockstep};
use crate::gap::fit::hypothesis::{Hypothesis, Slot};
use crate::gap::fit::problem::{Few, Problem, in_registers};
use crate::gap::fit::solver::{Schedule, Solution, solve, solve_near};
use crate::system::plant::physics::Physics;
use nalgebra::DMatrix;
use std::ops::Range;

/// A step that lowers the cost by less than this part of it is slow. Chosen by judgement; not studied.
const SLOW: f64 = 1e-4;
/// A step that promises less χ² than this, times the cost per sample, is not taken. Chosen by judgement, far below
/// the 12 that a name must bring; not studied.
const NEGLIGIBLE: f64 = 0.02;

/// Part of a step of a derivative where a cost is rugged: whole ones bend, so that a fit stops early, and numbers that can be traded for
/// each other (R, Kt, J and b) seem to be seen. Origin: of 73 drawn cases with teeth 57 get their names, 55 with whole steps, for three
/// quarters of the computing time.
const RUGGED: f64 = 0.01;
/// The starts of fewer runs are numbers like all others, whose columns follow the steps of a fit. Chosen by judgement; not studied.
const MANY_RUNS: usize = 16;
/// The largest residual, in standard deviations. Chosen by judgement; not studied.
const FAR: f64 = 1e6;

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
    /// Part of the steps of derivatives that is taken.
    step: f64,
    /// Of the starts of runs, which are the last numbers, the residuals that they move.
    few: Vec<Few>,
}

impl<'h, 'a> Evaluator<'h, 'a> {
    /// For a hypothesis.
    pub fn new(hypothesis: &'h Hypothesis<'a>, setting: &Setting) -> Self {
        let step = if hypothesis.is_rugged() { RUGGED } else { 1.0 };
        let few = Vec::new();
        let mut made = Self { hypothesis, parts: setting.parts, finest: setting.finest, step, few };
        made.few = made.of_starts();
        made
    }

    /// The residuals that the starts of runs move.
    fn of_starts(&self) -> Vec<Few> {
        let Hypothesis { dataset, slots, .. } = self.hypothesis;
        let run = |slot: &Slot| if let Slot::Start { run } = slot { Some(*run) } else { None };
        let starts: Vec<usize> = slots.iter().filter_map(run).collect();
        if starts.len() < MANY_RUNS {
            return Vec::new();
        }
        let signals = |run: &GridRun| run.speed.number_of(self.parts) + run.current.number_of(self.parts);
        let ends = dataset.runs.iter().scan(0, |end, run| {
            let from = *end;
            *end += if self.compares(run) { signals(run) } else { 0 };
            Some(from..*end)
        });
        let rows: Vec<Range<usize>> = ends.collect();
        let priors = slots.len() - self.hypothesis.effect_slots() - starts.len() + rows[rows.len() - 1].end;
        starts.iter().enumerate().map(|(k, run)| (rows[*run].clone(), priors + k)).collect()
    }

    /// True if residuals of a run count.
    fn compares(&self, run: &GridRun) -> bool {
        run.log == 0 || self.parts == [Part::HoldOut]
    }

    /// Weighted residuals of another plant than that of the numbers, and their priors.
    pub fn of_plant(&self, plant: &Physics, x: &[f64], out: &mut Vec<f64>) {
        self.simulated(vec![plant.clone()], &[x], self.finest, std::slice::from_mut(out));
    }

    /// Weighted residuals and priors of several sets of numbers.
    pub fn of_all(&self, many: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.of_plants(many.iter().map(|x| self.hypothesis.plant(x)).collect(), many)
    }

    /// The same of sets that differ little: all are simulated in the steps of those that need the shortest.
    pub fn of_kin(&self, many: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.of_plants(Physics::in_step(many.iter().map(|x| self.hypothesis.plant(x)).collect()), many)
    }

    fn of_plants(&self, plants: Vec<Physics>, many: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let places: Vec<&[f64]> = many.iter().map(Vec::as_slice).collect();
        let mut residuals = vec![Vec::new(); many.len()];
        self.simulated(plants, &places, self.finest, &mut residuals);
        residuals
    }

    /// Of places near another one, in whose steps all are simulated.
    fn compared(&self, near: &[f64], many: &[&[f64]], finest: f64, out: &mut [Vec<f64>]) {
        let near = self.hypothesis.plant(near);
        let plants = many.iter().map(|x| self.hypothesis.plant(x).in_steps_of(&near));
        self.simulated(plants.collect(), many, finest, out);
    }

    fn simulated(&self, plants: Vec<Physics>, many: &[&[f64]], finest: f64, out: &mut [Vec<f64>]) {
        let runs = self.hypothesis.dataset.runs.iter().enumerate();
        let compared = |(index, run)| {
            let start = |x: &&[f64]| self.hypothesis.start_speed(index, x);
            Compared { run, starts: many.iter().map(start).collect() }
        };
        let runs: Vec<Compared> = runs.filter(|(_, run)| self.compares(run)).map(compared).collect();
        let room = runs.iter().map(|Compared { run, .. }| run.speed.len() + run.current.len()).sum::<usize>();
        for out in out.iter_mut() {
            out.clear();
            out.reserve(room + self.hypothesis.slots.len());
        }
        lockstep(&runs, &plants, self.parts, finest, out);
        for (x, out) in many.iter().zip(out) {
            out.extend(self.hypothesis.priors(x));
            // A simulation that ran away must lose, not poison the sums. (Not a number is not within the limit either.)
            in_registers(|| out.iter_mut().for_each(|r| *r = if r.abs() <= FAR { *r } else { FAR }));
        }
    }
}

impl Problem for Evaluator<'_, '_> {
    fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>) {
        self.compared(x, &[x], self.finest, std::slice::from_mut(out));
    }

    fn residuals_near(&mut self, x: &[f64], many: &[&[f64]], out: &mut [Vec<f64>]) {
        self.compared(x, many, self.finest, out);
    }

    fn probed_near(&mut self, x: &[f64], many: &[&[f64]], out: &mut [Vec<f64>]) {
        self.compared(x, many, COARSE, out);
    }

    fn probes_alike(&self) -> bool {
        self.finest == COARSE
    }

    fn bounds(&self, slot: usize) -> (f64, f64) {
        self.hypothesis.bounds(slot)
    }

    fn step(&self, slot: usize) -> f64 {
        self.step * self.hypothesis.step(slot)
    }

    fn few(&self, slot: usize) -> Option<Few> {
        Some(self.few[(slot + self.few.len()).checked_sub(self.hypothesis.slots.len())?].clone())
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
    fitted(hypothesis, solve_near(&mut evaluator, start, &setting.schedule(), columns))
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
