//! Fitting one hypothesis by simulation error: least squares on the free-run residual and on the priors.
//!
//! Levenberg–Marquardt with bounds by projection (Nocedal, Wright: Numerical Optimization, 2006, chapter 10) and a
//! numeric Jacobian: a simulation is so cheap that nothing cleverer pays.

use crate::bench::{Part, Traces};
use crate::hypothesis::Hypothesis;
use nalgebra::{DMatrix, DVector};

/// Longest step of the simulation in the search, as a part of the time constant.
pub const COARSE: f64 = 1.0 / 45.0;
/// … and in the final fits.
pub const FINE: f64 = 1.0 / 180.0;

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

    fn compare(&self, probes: &crate::bench::Probes, out: &mut Vec<f64>) {
        for (k, predicted) in self.predicted.iter().enumerate() {
            if self.parts.contains(&probes.part[k]) {
                out.push((probes.measured[k] - predicted) * probes.weight[k]);
            }
        }
    }
}

/// Columns of derivatives of the residuals.
pub struct Jacobian {
    /// One column a number.
    pub columns: Vec<Vec<f64>>,
}

impl Jacobian {
    /// By one-sided differences; the step turns round at an upper bound.
    pub fn at(
        evaluator: &mut Evaluator,
        x: &[f64],
        residuals: &[f64],
        slots: std::ops::Range<usize>,
    ) -> Self {
        let mut probe = x.to_vec();
        let mut moved = Vec::with_capacity(residuals.len());
        let mut columns = Vec::with_capacity(slots.len());
        for slot in slots {
            let (step, upper) = (
                evaluator.hypothesis.step(slot),
                evaluator.hypothesis.bounds(slot).1,
            );
            let step = if x[slot] + step > upper { -step } else { step };
            probe[slot] = x[slot] + step;
            evaluator.residuals(&probe, &mut moved);
            columns.push(moved.iter().zip(residuals).map(|(a, b)| (a - b) / step).collect());
            probe[slot] = x[slot];
        }
        Self { columns }
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

/// Sum of products.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Fits a hypothesis from a start.
pub fn fit(hypothesis: &Hypothesis, start: &[f64], setting: &Setting) -> Fit {
    let mut evaluator = Evaluator::new(hypothesis, setting);
    let mut x: Vec<f64> = start
        .iter()
        .enumerate()
        .map(|(k, v)| clipped(hypothesis, k, *v))
        .collect();
    let mut residuals = Vec::new();
    evaluator.residuals(&x, &mut residuals);
    let mut cost = dot(&residuals, &residuals);
    let (mut lambda, mut slow) = (1e-2, 0);
    for _ in 0..setting.iterations {
        let jacobian = Jacobian::at(&mut evaluator, &x, &residuals, 0..x.len());
        let Some((next, next_residuals, next_cost)) = descend(
            hypothesis,
            &mut evaluator,
            &jacobian,
            &x,
            &residuals,
            cost,
            &mut lambda,
        ) else {
            break;
        };
        slow = if (cost - next_cost) < 1e-4 * cost {
            slow + 1
        } else {
            0
        };
        (x, residuals, cost) = (next, next_residuals, next_cost);
        if slow >= 2 {
            break;
        }
    }
    let priors: f64 = hypothesis
        .slots
        .iter()
        .zip(&x)
        .filter(|(slot, _)| slot.has_prior())
        .map(|(_, z)| z * z)
        .sum();
    let samples = residuals.len() - hypothesis.slots.iter().filter(|slot| slot.has_prior()).count();
    Fit {
        x,
        cost,
        chi2: cost - priors,
        samples,
    }
}

/// One step that lowers the cost, if there is one.
fn descend(
    hypothesis: &Hypothesis,
    evaluator: &mut Evaluator,
    jacobian: &Jacobian,
    x: &[f64],
    residuals: &[f64],
    cost: f64,
    lambda: &mut f64,
) -> Option<(Vec<f64>, Vec<f64>, f64)> {
    let (normal, gradient) = (jacobian.normal(), jacobian.gradient(residuals));
    let held: Vec<bool> = (0..x.len())
        .map(|k| at_bound(hypothesis, k, x[k], gradient[k]))
        .collect();
    for _ in 0..6 {
        if let Some(step) = damped_step(&normal, &gradient, &held, *lambda) {
            let next: Vec<f64> = x
                .iter()
                .enumerate()
                .map(|(k, v)| clipped(hypothesis, k, v + step[k]))
                .collect();
            let mut moved = Vec::with_capacity(residuals.len());
            evaluator.residuals(&next, &mut moved);
            let next_cost = dot(&moved, &moved);
            if next_cost < cost {
                *lambda = (*lambda / 8.0).max(1e-9);
                return Some((next, moved, next_cost));
            }
        }
        *lambda *= 6.0;
    }
    None
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
    let mut evaluator = Evaluator::new(hypothesis, setting);
    let mut residuals = Vec::new();
    evaluator.residuals(&fit.x, &mut residuals);
    let jacobian = Jacobian::at(&mut evaluator, &fit.x, &residuals, 0..fit.x.len());
    let mut normal = jacobian.normal();
    for k in 0..fit.x.len() {
        normal[(k, k)] += 1e-12 * (1.0 + normal[(k, k)]);
    }
    normal
        .try_inverse()
        .unwrap_or_else(|| DMatrix::zeros(fit.x.len(), fit.x.len()))
}
