//! Numeric derivatives of residuals. The columns are simulated together, which is cheaper than one by one.

use super::problem::{Problem, clipped, dot};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Columns of derivatives of the residuals.
#[derive(Clone, Debug)]
pub struct Jacobian {
    /// One column a number.
    pub columns: Vec<Vec<f64>>,
}

/// Places beside another one, at each of which one number has moved by its step.
pub struct Beside {
    slots: Range<usize>,
    steps: Vec<f64>,
    /// The places.
    pub places: Vec<Vec<f64>>,
}

impl Beside {
    /// For some of the numbers; a step that would cross the upper bound turns round.
    pub fn new(problem: &impl Problem, x: &[f64], slots: Range<usize>) -> Self {
        let step = |slot: usize| {
            let step = problem.step(slot);
            if x[slot] + step > problem.bounds(slot).1 { -step } else { step }
        };
        let steps: Vec<f64> = slots.clone().map(step).collect();
        let place = |(slot, step): (usize, &f64)| {
            let mut place = x.to_vec();
            place[slot] += step;
            place
        };
        let places = slots.clone().zip(&steps).map(place).collect();
        Self { slots, steps, places }
    }
}

impl Jacobian {
    /// Without derivatives yet.
    pub fn empty(numbers: usize) -> Self {
        Self { columns: vec![Vec::new(); numbers] }
    }

    /// Differences to both sides, within the bounds. Where numbers can be traded for each other their columns cancel, and what a
    /// one-sided difference bends by would pass for information, the more the lower the noise.
    pub fn probed(problem: &mut impl Problem, x: &[f64]) -> Self {
        let moved_by = |slot: usize, sign: f64| {
            let mut place = x.to_vec();
            place[slot] = clipped(problem, slot, x[slot] + sign * problem.step(slot));
            place
        };
        let sides = |sign: f64| (0..x.len()).map(|slot| moved_by(slot, sign)).collect::<Vec<_>>();
        let [up, down] = [1.0, -1.0].map(sides);
        let places: Vec<&[f64]> = up.iter().chain(&down).map(Vec::as_slice).collect();
        let mut moved = vec![Vec::new(); places.len()];
        problem.probed_near(x, &places, &mut moved);
        let (high, low) = moved.split_at(x.len());
        let column =
            |k: usize| high[k].iter().zip(&low[k]).map(|(a, b)| (a - b) / (up[k][k] - down[k][k])).collect();
        Self { columns: (0..x.len()).map(column).collect() }
    }

    /// Computes some columns anew, as one-sided differences. They are probed, whatever the grid of the residuals: a derivative that is off
    /// by its part in a thousand costs no accuracy, only a little convergence. `residuals`: those at `x`.
    pub fn renew(&mut self, problem: &mut impl Problem, x: &[f64], residuals: &[f64], slots: Range<usize>) {
        if !problem.probes_alike() {
            return self.probe(problem, x, slots);
        }
        let beside = Beside::new(problem, x, slots);
        let places: Vec<&[f64]> = beside.places.iter().map(Vec::as_slice).collect();
        let mut moved = vec![Vec::new(); places.len()];
        problem.probed_near(x, &places, &mut moved);
        self.take(&beside, residuals, &moved);
    }

    fn probe(&mut self, problem: &mut impl Problem, x: &[f64], slots: Range<usize>) {
        let beside = Beside::new(problem, x, slots);
        let places: Vec<&[f64]> = std::iter::once(x).chain(beside.places.iter().map(Vec::as_slice)).collect();
        let mut moved = vec![Vec::new(); places.len()];
        problem.probed_near(x, &places, &mut moved);
        self.take(&beside, &moved[0], &moved[1..]);
    }

    /// Takes the columns over from the residuals at a place and beside it.
    pub fn take(&mut self, beside: &Beside, here: &[f64], moved: &[Vec<f64>]) {
        for ((slot, step), moved) in beside.slots.clone().zip(&beside.steps).zip(moved) {
            let column = &mut self.columns[slot];
            column.clear();
            column.extend(moved.iter().zip(here).map(|(a, b)| (a - b) / step));
        }
    }

    /// Corrects all columns by what a step really did, each number measured by its own effect.
    pub fn follow(&mut self, step: &[f64], before: &[f64], after: &[f64]) {
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
