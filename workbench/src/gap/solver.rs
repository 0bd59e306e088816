//! The one least-squares solver: Levenberg–Marquardt with bounds by projection (Nocedal, Wright: Numerical Optimization,
//! 2006, chapter 10) and a numeric Jacobian. Records over time and tables of settled speeds are both a [`Problem`].
//!
//! A simulation is so cheap that nothing cleverer pays, but columns of the Jacobian that bend little are not computed
//! anew after a step: they follow it (Broyden, Math. Comp. 19, 1965).

use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// The smallest of Levenberg's dampings, which is as good as none.
const LEAST_DAMPING: f64 = 1e-9;
/// The damping with which a descent begins.
const FIRST_DAMPING: f64 = 1e-2;
/// Dampings that are tried for one step.
const TRIES: usize = 6;
/// Slow steps in a row that end a descent.
const SLOW_STEPS: usize = 2;

/// What is minimised: the sum of the squares of residuals over numbers with bounds.
pub trait Problem {
    /// The residuals, each over its standard deviation: the compared samples first, the priors last.
    fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>);

    /// The residuals as finely as a derivative needs them.
    fn probed(&mut self, x: &[f64], out: &mut Vec<f64>) {
        self.residuals(x, out);
    }

    /// True if [`Self::probed`] gives what [`Self::residuals`] gives.
    fn probes_alike(&self) -> bool {
        true
    }

    /// Lower and upper bound of a number.
    fn bounds(&self, slot: usize) -> (f64, f64);

    /// Step of the numeric derivative of a number.
    fn step(&self, slot: usize) -> f64;

    /// So many numbers at the front bend the residuals so much that their derivatives are computed anew before each step.
    fn bending(&self) -> usize;
}

/// When a descent ends.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    /// Steps at most.
    pub iterations: usize,
    /// A step that lowers the cost by less than this part of it is slow.
    pub slow: f64,
    /// A step that promises less than this, times the cost per residual where that is above 1, is not taken.
    pub negligible: f64,
}

/// Where a descent ended.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The numbers.
    pub x: Vec<f64>,
    /// The residuals there.
    pub residuals: Vec<f64>,
    /// The sum of their squares.
    pub cost: f64,
}

/// Solves a problem from a start.
pub fn solve(problem: &mut impl Problem, start: &[f64], schedule: &Schedule) -> Solution {
    let mut descent = Descent::new(problem, start, schedule);
    descent.jacobian = Jacobian::at(descent.problem, &descent.x, &descent.residuals);
    descent.run()
}

/// Solves a problem near another one, of which some columns of the Jacobian are known; those of the numbers that bend the
/// residuals are not used.
pub fn solve_near(
    problem: &mut impl Problem,
    start: &[f64],
    schedule: &Schedule,
    columns: Vec<Vec<f64>>,
) -> Solution {
    let mut descent = Descent::new(problem, start, schedule);
    descent.jacobian.columns = columns;
    (descent.followed, descent.late) = (true, true);
    descent.run()
}

/// Covariance of the numbers at a solution, (JᵀJ + ridge)⁻¹ with the priors inside; `None` where it is singular. `ridge`
/// is a function of the number's place and of its own information.
pub fn covariance(
    problem: &mut impl Problem,
    x: &[f64],
    ridge: impl Fn(usize, f64) -> f64,
) -> Option<DMatrix<f64>> {
    let mut here = Vec::new();
    problem.probed(x, &mut here);
    let mut information = Jacobian::from(problem, x, &here).normal();
    for k in 0..x.len() {
        information[(k, k)] += ridge(k, information[(k, k)]);
    }
    information.try_inverse()
}

/// Columns of derivatives of the residuals.
#[derive(Clone, Debug)]
pub struct Jacobian {
    /// One column a number.
    pub columns: Vec<Vec<f64>>,
}

impl Jacobian {
    /// One-sided differences. They are probed, whatever the grid of the residuals: a derivative that is off by its part in
    /// a thousand costs no accuracy, only a little convergence.
    pub fn at(problem: &mut impl Problem, x: &[f64], residuals: &[f64]) -> Self {
        let here = probed_at(problem, x, residuals);
        Self::from(problem, x, &here)
    }

    fn from(problem: &mut impl Problem, x: &[f64], here: &[f64]) -> Self {
        let columns = vec![Vec::new(); x.len()];
        let mut jacobian = Self { columns };
        jacobian.renew(problem, x, here, 0..x.len());
        jacobian
    }

    /// Computes some columns anew; a step that would cross the upper bound turns round.
    fn renew(&mut self, problem: &mut impl Problem, x: &[f64], here: &[f64], slots: Range<usize>) {
        let (mut probe, mut moved) = (x.to_vec(), Vec::new());
        for slot in slots {
            let (upper, step) = (problem.bounds(slot).1, problem.step(slot));
            let step = if x[slot] + step > upper { -step } else { step };
            probe[slot] = x[slot] + step;
            problem.probed(&probe, &mut moved);
            self.columns[slot].clear();
            self.columns[slot].extend(moved.iter().zip(here).map(|(a, b)| (a - b) / step));
            probe[slot] = x[slot];
        }
    }

    /// Corrects all columns by what a step really did, each number measured by its own effect.
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

    /// The normal matrix JᵀJ.
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

    /// Half of the gradient of the cost, Jᵀr.
    pub fn gradient(&self, residuals: &[f64]) -> DVector<f64> {
        DVector::from_iterator(self.columns.len(), self.columns.iter().map(|column| dot(column, residuals)))
    }
}

fn probed_at(problem: &mut impl Problem, x: &[f64], residuals: &[f64]) -> Vec<f64> {
    let mut here = residuals.to_vec();
    if !problem.probes_alike() {
        problem.probed(x, &mut here);
    }
    here
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

/// A number inside its bounds.
pub fn clipped(problem: &impl Problem, slot: usize, value: f64) -> f64 {
    let (lower, upper) = problem.bounds(slot);
    value.clamp(lower, upper)
}

/// A descent under way.
struct Descent<'p, P> {
    problem: &'p mut P,
    schedule: &'p Schedule,
    x: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
    jacobian: Jacobian,
    /// True if columns were corrected by steps since they were computed.
    followed: bool,
    /// True if the columns that bend belong to the numbers before the last step.
    late: bool,
    damping: f64,
}

impl<'p, P: Problem> Descent<'p, P> {
    fn new(problem: &'p mut P, start: &[f64], schedule: &'p Schedule) -> Self {
        let places = start.iter().enumerate();
        let x: Vec<f64> = places.map(|(k, v)| clipped(problem, k, *v)).collect();
        let mut residuals = Vec::new();
        problem.residuals(&x, &mut residuals);
        Self {
            cost: dot(&residuals, &residuals),
            jacobian: Jacobian { columns: Vec::new() },
            problem,
            schedule,
            x,
            residuals,
            followed: false,
            late: false,
            damping: FIRST_DAMPING,
        }
    }

    fn run(mut self) -> Solution {
        let mut slow = 0;
        for _ in 0..self.schedule.iterations {
            let before = self.cost;
            if self.lower() {
                let gained = before - self.cost >= self.schedule.slow * before;
                slow = if gained { 0 } else { slow + 1 };
                if slow >= SLOW_STEPS {
                    break;
                }
            } else if self.followed {
                // The columns that only followed may be to blame.
                self.jacobian = Jacobian::at(self.problem, &self.x, &self.residuals);
                self.followed = false;
            } else {
                break;
            }
        }
        let (x, residuals, cost) = (self.x, self.residuals, self.cost);
        Solution { x, residuals, cost }
    }

    /// One step that lowers the cost; false if there is none worth taking.
    fn lower(&mut self) -> bool {
        if self.late {
            let here = probed_at(self.problem, &self.x, &self.residuals);
            let bending = 0..self.problem.bending();
            self.jacobian.renew(self.problem, &self.x, &here, bending);
            self.late = false;
        }
        let normal = Normal::new(self);
        let negligible = self.schedule.negligible * (self.cost / self.residuals.len() as f64).max(1.0);
        // Where numbers can be traded against each other, only their priors pull along the valley, and the least
        // damping hides that: whether there is anything to gain is asked without.
        if (normal.step(LEAST_DAMPING)).is_some_and(|step| normal.promise(&step) < negligible) {
            return false;
        }
        for _ in 0..TRIES {
            if let Some(step) = normal.step(self.damping) {
                if normal.promise(&step) < negligible && self.damping > LEAST_DAMPING {
                    self.damping = (self.damping / 1e3).max(LEAST_DAMPING);
                    continue;
                }
                if self.steps(&step) {
                    self.damping = (self.damping / 8.0).max(LEAST_DAMPING);
                    return true;
                }
            }
            self.damping *= 6.0;
        }
        false
    }

    /// Takes a step if it lowers the cost. The columns that bend little follow; the others are computed anew before the
    /// next step.
    fn steps(&mut self, step: &DVector<f64>) -> bool {
        let places = self.x.iter().zip(step.iter()).enumerate();
        let next: Vec<f64> = places.map(|(k, (x, step))| clipped(self.problem, k, x + step)).collect();
        let mut moved = Vec::with_capacity(self.residuals.len());
        self.problem.residuals(&next, &mut moved);
        let cost = dot(&moved, &moved);
        // Not a number is no gain either.
        let lower = cost < self.cost;
        if lower {
            self.follow(&next, &moved);
            (self.x, self.residuals, self.cost) = (next, moved, cost);
        }
        lower
    }

    fn follow(&mut self, next: &[f64], moved: &[f64]) {
        let step: Vec<f64> = next.iter().zip(&self.x).map(|(a, b)| a - b).collect();
        self.jacobian.follow(&step, &self.residuals, moved);
        (self.followed, self.late) = (true, true);
    }
}

/// The normal equations at one place.
struct Normal {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Numbers that sit at a bound which the descent would cross.
    held: Vec<bool>,
}

impl Normal {
    fn new<P: Problem>(descent: &Descent<P>) -> Self {
        let gradient = descent.jacobian.gradient(&descent.residuals);
        let held = |(k, x): (usize, &f64)| {
            let (lower, upper) = descent.problem.bounds(k);
            (*x <= lower && gradient[k] > 0.0) || (*x >= upper && gradient[k] < 0.0)
        };
        Self {
            matrix: descent.jacobian.normal(),
            held: descent.x.iter().enumerate().map(held).collect(),
            gradient,
        }
    }

    /// By how much a step lowers the cost where the residuals are linear.
    fn promise(&self, step: &DVector<f64>) -> f64 {
        -(2.0 * self.gradient.dot(step) + step.dot(&(&self.matrix * step)))
    }

    /// Solves (JᵀJ + λ·diag) d = −Jᵀr with some numbers held.
    fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let mut matrix = self.matrix.clone();
        let mut right = -&self.gradient;
        for (k, held) in self.held.iter().enumerate() {
            let diagonal = self.matrix[(k, k)];
            matrix[(k, k)] = diagonal * (1.0 + damping) + 1e-12 * (1.0 + diagonal);
            if *held {
                matrix.row_mut(k).fill(0.0);
                matrix.column_mut(k).fill(0.0);
                matrix[(k, k)] = 1.0;
                right[k] = 0.0;
            }
        }
        matrix.cholesky().map(|factor| factor.solve(&right))
    }
}
