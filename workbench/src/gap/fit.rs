//! Fitting one hypothesis by simulation error: least squares on the free-run residual and on the priors.
//!
//! Levenberg–Marquardt with bounds by projection (Nocedal, Wright: Numerical Optimization, 2006, chapter 10) and a
//! numeric Jacobian: a simulation is so cheap that nothing cleverer pays.

use crate::gap::dataset::{Part, Traces};
use crate::gap::hypothesis::{Hypothesis, Slot};
use nalgebra::{DMatrix, DVector};

/// Longest step of the simulation in the search, as a part of the time constant.
pub const COARSE: f64 = 1.0 / 45.0;
/// … and in the final fits.
pub const FINE: f64 = 1.0 / 180.0;

/// A step that lowers the cost by less than this part of it is slow; two of them end a fit.
const SLOW: f64 = 1e-4;
/// A step that promises less χ² than this, times the cost per sample, is not taken: no name depends on it.
const NEGLIGIBLE: f64 = 0.02;

/// Levenberg's damping that is none.
const LEAST_DAMPING: f64 = 1e-9;

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
pub const SEARCH: Setting = Setting {
    parts: &[Part::A, Part::B],
    finest: COARSE,
    iterations: 12,
};
/// Both folds, fine: the result.
pub const FINAL: Setting = Setting {
    parts: &[Part::A, Part::B],
    finest: FINE,
    iterations: 5,
};

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
    traces: Traces,
    predicted: Vec<f64>,
}

impl<'h, 'a> Evaluator<'h, 'a> {
    /// For a hypothesis.
    pub fn new(hypothesis: &'h Hypothesis<'a>, setting: &Setting) -> Self {
        let (traces, predicted) = (Traces::default(), Vec::new());
        Self {
            hypothesis,
            parts: setting.parts,
            finest: setting.finest,
            traces,
            predicted,
        }
    }

    /// Weighted residuals and priors.
    pub fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>) {
        out.clear();
        let plant = self.hypothesis.plant(x);
        let only_holdout = self.parts == [Part::HoldOut];
        for (index, run) in self.hypothesis.bench.runs.iter().enumerate() {
            if run.log > 0 && !only_holdout {
                continue;
            }
            run.simulate(
                &plant,
                self.hypothesis.start_speed(index, x),
                self.finest,
                &mut self.traces,
            );
            run.speed.predict(
                &run.time,
                &self.traces.reading,
                &self.traces.integral,
                &mut self.predicted,
            );
            self.compare(&run.speed, out);
            if !run.current.is_empty() {
                run.current.predict(
                    &run.time,
                    &self.traces.current,
                    &self.traces.charge,
                    &mut self.predicted,
                );
                self.compare(&run.current, out);
            }
        }
        let priors = self
            .hypothesis
            .slots
            .iter()
            .zip(x)
            .filter(|(slot, _)| slot.has_prior());
        out.extend(priors.map(|(_, z)| *z));
        // A simulation that ran away must lose, not poison the sums.
        out.iter_mut()
            .filter(|r| r.is_nan() || r.abs() > 1e6)
            .for_each(|r| *r = 1e6);
    }

    /// Derivatives at some numbers.
    pub fn jacobian(&mut self, x: &[f64]) -> Jacobian {
        let mut residuals = Vec::new();
        if self.finest == COARSE {
            self.residuals(x, &mut residuals);
        }
        Jacobian::at(self, x, &residuals)
    }

    fn compare(&self, probes: &crate::gap::dataset::Probes, out: &mut Vec<f64>) {
        for (k, predicted) in self.predicted.iter().enumerate() {
            if self.parts.contains(&probes.part[k]) {
                out.push((probes.measured[k] - predicted) * probes.weight[k]);
            }
        }
    }
}

/// Columns of derivatives of the residuals.
#[derive(Clone, Debug)]
pub struct Jacobian {
    /// One column a number.
    pub columns: Vec<Vec<f64>>,
}

impl Jacobian {
    /// By one-sided differences on the coarse grid, whatever the grid of the residuals: a derivative that is off by its
    /// part in a thousand costs no accuracy, only a little convergence.
    pub fn at(evaluator: &mut Evaluator, x: &[f64], residuals: &[f64]) -> Self {
        let mut made = Self {
            columns: vec![Vec::new(); x.len()],
        };
        made.renew(evaluator, x, residuals, 0..x.len());
        made
    }

    /// Computes some columns anew; the step turns round at an upper bound.
    fn renew(
        &mut self,
        evaluator: &mut Evaluator,
        x: &[f64],
        residuals: &[f64],
        slots: std::ops::Range<usize>,
    ) {
        let finest = std::mem::replace(&mut evaluator.finest, COARSE);
        let (mut here, mut moved) = (residuals.to_vec(), Vec::new());
        if finest != COARSE {
            evaluator.residuals(x, &mut here);
        }
        let mut probe = x.to_vec();
        for slot in slots {
            let upper = evaluator.hypothesis.bounds(slot).1;
            let step = evaluator.hypothesis.step(slot);
            let step = if x[slot] + step > upper { -step } else { step };
            probe[slot] = x[slot] + step;
            evaluator.residuals(&probe, &mut moved);
            self.columns[slot].clear();
            self.columns[slot].extend(moved.iter().zip(&here).map(|(a, b)| (a - b) / step));
            probe[slot] = x[slot];
        }
        evaluator.finest = finest;
    }

    /// Corrects all columns by what a step really did (Broyden, Math. Comp. 19, 1965), each number measured by its
    /// own effect.
    fn follow(&mut self, step: &[f64], before: &[f64], after: &[f64]) {
        let weights: Vec<f64> = self.columns.iter().map(|column| dot(column, column)).collect();
        let length: f64 = step.iter().zip(&weights).map(|(d, w)| w * d * d).sum();
        if length <= 0.0 {
            return;
        }
        let mut error: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
        for (column, d) in self.columns.iter().zip(step) {
            error.iter_mut().zip(column).for_each(|(e, c)| *e -= c * d);
        }
        for ((column, d), w) in self.columns.iter_mut().zip(step).zip(&weights) {
            let share = w * d / length;
            column.iter_mut().zip(&error).for_each(|(c, e)| *c += share * e);
        }
    }

    /// JᵀJ.
    pub fn normal(&self) -> DMatrix<f64> {
        let n = self.columns.len();
        let mut normal = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let sum = dot(&self.columns[i], &self.columns[j]);
                normal[(i, j)] = sum;
                normal[(j, i)] = sum;
            }
        }
        normal
    }

    /// Jᵀr.
    pub fn gradient(&self, residuals: &[f64]) -> DVector<f64> {
        DVector::from_iterator(
            self.columns.len(),
            self.columns.iter().map(|column| dot(column, residuals)),
        )
    }
}

/// Sum of products. Four sums side by side: one alone would wait for itself.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (heads, tails) = (a.chunks_exact(4).zip(b.chunks_exact(4)), a.len() / 4 * 4);
    for (x, y) in heads {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    let rest: f64 = a[tails..].iter().zip(&b[tails..]).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f64>() + rest
}

/// Fits a hypothesis from a start.
pub fn fit(hypothesis: &Hypothesis, start: &[f64], setting: &Setting) -> Fit {
    let mut descent = Descent::new(hypothesis, start, setting);
    descent.jacobian = Jacobian::at(&mut descent.evaluator, &descent.x, &descent.residuals);
    descent.run(setting.iterations)
}

/// Fits a hypothesis near another one, whose derivatives with respect to the nuisances are known.
pub fn fit_near(
    hypothesis: &Hypothesis,
    start: &[f64],
    setting: &Setting,
    known: &dyn Fn(&Slot) -> Option<Vec<f64>>,
) -> Fit {
    let mut descent = Descent::new(hypothesis, start, setting);
    let columns = hypothesis
        .slots
        .iter()
        .map(|slot| known(slot).unwrap_or_default());
    descent.jacobian.columns = columns.collect();
    (descent.followed, descent.late) = (true, true);
    descent.run(setting.iterations)
}

/// A fit under way.
struct Descent<'h, 'a> {
    evaluator: Evaluator<'h, 'a>,
    x: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
    jacobian: Jacobian,
    /// True if the nuisances' columns were corrected by steps since they were computed.
    followed: bool,
    /// True if the effects' columns belong to the numbers before the last step.
    late: bool,
    lambda: f64,
}

impl<'h, 'a> Descent<'h, 'a> {
    fn new(hypothesis: &'h Hypothesis<'a>, start: &[f64], setting: &Setting) -> Self {
        let mut evaluator = Evaluator::new(hypothesis, setting);
        let x: Vec<f64> = start
            .iter()
            .enumerate()
            .map(|(k, v)| clipped(hypothesis, k, *v))
            .collect();
        let mut residuals = Vec::new();
        evaluator.residuals(&x, &mut residuals);
        Self {
            cost: dot(&residuals, &residuals),
            jacobian: Jacobian { columns: Vec::new() },
            evaluator,
            x,
            residuals,
            followed: false,
            late: false,
            lambda: 1e-2,
        }
    }

    fn run(mut self, iterations: usize) -> Fit {
        let mut slow = 0;
        for _ in 0..iterations {
            let before = self.cost;
            if self.lower() {
                slow = if before - self.cost < SLOW * before {
                    slow + 1
                } else {
                    0
                };
                if slow >= 2 {
                    break;
                }
            } else if self.followed {
                // The columns that only followed may be to blame.
                self.jacobian = Jacobian::at(&mut self.evaluator, &self.x, &self.residuals);
                self.followed = false;
            } else {
                break;
            }
        }
        self.done()
    }

    /// One step that lowers the cost; false if there is none worth taking.
    fn lower(&mut self) -> bool {
        let hypothesis = self.evaluator.hypothesis;
        if self.late {
            let effects = 0..hypothesis.effect_slots();
            self.jacobian
                .renew(&mut self.evaluator, &self.x, &self.residuals, effects);
            self.late = false;
        }
        let (normal, gradient) = (self.jacobian.normal(), self.jacobian.gradient(&self.residuals));
        let held: Vec<bool> = (0..self.x.len())
            .map(|k| at_bound(hypothesis, k, self.x[k], gradient[k]))
            .collect();
        let negligible = NEGLIGIBLE * (self.cost / self.residuals.len() as f64).max(1.0);
        let promise = |step: &DVector<f64>| -(2.0 * gradient.dot(step) + step.dot(&(&normal * step)));
        // Where numbers can be traded against each other, only their priors pull along the valley, and the least
        // damping hides that: whether there is anything to gain is asked without.
        if damped_step(&normal, &gradient, &held, LEAST_DAMPING).is_some_and(|s| promise(&s) < negligible) {
            return false;
        }
        for _ in 0..6 {
            if let Some(step) = damped_step(&normal, &gradient, &held, self.lambda) {
                if promise(&step) < negligible && self.lambda > LEAST_DAMPING {
                    self.lambda = (self.lambda / 1e3).max(LEAST_DAMPING);
                    continue;
                }
                let next: Vec<f64> = (0..self.x.len())
                    .map(|k| clipped(hypothesis, k, self.x[k] + step[k]))
                    .collect();
                let mut moved = Vec::with_capacity(self.residuals.len());
                self.evaluator.residuals(&next, &mut moved);
                let cost = dot(&moved, &moved);
                if cost < self.cost {
                    self.lambda = (self.lambda / 8.0).max(LEAST_DAMPING);
                    self.go(next, moved, cost);
                    return true;
                }
            }
            self.lambda *= 6.0;
        }
        false
    }

    /// Takes a step. The columns of the nuisances, which bend little, follow; those of the effects are computed anew
    /// before the next.
    fn go(&mut self, next: Vec<f64>, moved: Vec<f64>, cost: f64) {
        let step: Vec<f64> = next.iter().zip(&self.x).map(|(a, b)| a - b).collect();
        self.jacobian.follow(&step, &self.residuals, &moved);
        (self.followed, self.late) = (true, true);
        (self.x, self.residuals, self.cost) = (next, moved, cost);
    }

    fn done(self) -> Fit {
        let nuisances = || {
            let slots = self.evaluator.hypothesis.slots.iter().zip(&self.x);
            slots.filter(|(slot, _)| slot.has_prior())
        };
        let priors: f64 = nuisances().map(|(_, z)| z * z).sum();
        Fit {
            samples: self.residuals.len() - nuisances().count(),
            chi2: self.cost - priors,
            cost: self.cost,
            x: self.x,
        }
    }
}

/// True if a number sits at a bound and the descent would leave it.
fn at_bound(hypothesis: &Hypothesis, slot: usize, value: f64, gradient: f64) -> bool {
    let (lower, upper) = hypothesis.bounds(slot);
    (value <= lower && gradient > 0.0) || (value >= upper && gradient < 0.0)
}

fn clipped(hypothesis: &Hypothesis, slot: usize, value: f64) -> f64 {
    let (lower, upper) = hypothesis.bounds(slot);
    value.clamp(lower, upper)
}

/// Solves (JᵀJ + λ·diag) d = −Jᵀr with some numbers held.
fn damped_step(
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    held: &[bool],
    lambda: f64,
) -> Option<DVector<f64>> {
    let mut matrix = normal.clone();
    let mut right = -gradient;
    for k in 0..held.len() {
        let diagonal = normal[(k, k)];
        matrix[(k, k)] = diagonal * (1.0 + lambda) + 1e-12 * (1.0 + diagonal);
        if held[k] {
            matrix.row_mut(k).fill(0.0);
            matrix.column_mut(k).fill(0.0);
            matrix[(k, k)] = 1.0;
            right[k] = 0.0;
        }
    }
    matrix.cholesky().map(|factor| factor.solve(&right))
}

/// Covariance of the numbers at a fit: (JᵀJ)⁻¹, priors included; held numbers have none.
pub fn covariance(hypothesis: &Hypothesis, fit: &Fit, setting: &Setting) -> DMatrix<f64> {
    let mut normal = Evaluator::new(hypothesis, setting).jacobian(&fit.x).normal();
    for k in 0..fit.x.len() {
        normal[(k, k)] += 1e-12 * (1.0 + normal[(k, k)]);
    }
    normal
        .try_inverse()
        .unwrap_or_else(|| DMatrix::zeros(fit.x.len(), fit.x.len()))
}
