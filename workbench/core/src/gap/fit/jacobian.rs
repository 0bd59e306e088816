//! Numeric derivatives of residuals. The columns are simulated together, which is cheaper than one by one.

use super::problem::{Few, Problem, clipped, dot};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Columns of derivatives of the residuals.
#[derive(Clone, Debug)]
pub struct Jacobian {
    /// One column a number.
    pub columns: Vec<Vec<f64>>,
    few: Vec<Option<Few>>,
}

/// Places beside another one. At each of them one number has moved by its step, or all of those that move few residuals.
pub struct Beside {
    moved: Vec<Vec<(usize, f64)>>,
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
        Self::moved(problem, x, slots, |slot| (step(slot), x[slot] + step(slot)))
    }

    /// `to`: step of a number, and where it then is.
    fn moved(
        problem: &impl Problem,
        x: &[f64],
        slots: Range<usize>,
        to: impl Fn(usize) -> (f64, f64),
    ) -> Self {
        let (few, many): (Vec<usize>, Vec<usize>) = slots.partition(|slot| problem.few(*slot).is_some());
        let together = many.chunks(1).chain(Some(&few[..]).filter(|few| !few.is_empty()));
        let place = |slots: &[usize]| {
            let mut place = x.to_vec();
            slots.iter().for_each(|slot| place[*slot] = to(*slot).1);
            (slots.iter().map(|slot| (*slot, to(*slot).0)).collect::<Vec<_>>(), place)
        };
        let (moved, places) = together.map(place).unzip();
        Self { moved, places }
    }
}

impl Jacobian {
    /// With columns that may be empty.
    pub fn new(problem: &impl Problem, columns: Vec<Vec<f64>>) -> Self {
        Self { few: (0..columns.len()).map(|slot| problem.few(slot)).collect(), columns }
    }

    /// Differences to both sides, within the bounds. Where numbers can be traded for each other their columns cancel, and what a
    /// one-sided difference bends by would pass for information, the more the lower the noise.
    pub fn probed(problem: &mut impl Problem, x: &[f64]) -> Self {
        let side = |sign: f64| {
            let at = |slot: usize, sign: f64| clipped(problem, slot, x[slot] + sign * problem.step(slot));
            Beside::moved(problem, x, 0..x.len(), |slot| (at(slot, 1.0) - at(slot, -1.0), at(slot, sign)))
        };
        let [up, down] = [1.0, -1.0].map(side);
        let places: Vec<&[f64]> = up.places.iter().chain(&down.places).map(Vec::as_slice).collect();
        let mut moved = vec![Vec::new(); places.len()];
        problem.probed_near(x, &places, &mut moved);
        let (high, low) = moved.split_at(up.places.len());
        let mut made = Self::new(problem, vec![Vec::new(); x.len()]);
        made.take(&up, low, high);
        made
    }

    /// Computes some columns anew, as one-sided differences. They are probed, whatever the grid of the residuals: a derivative that is off
    /// by its part in a thousand costs no accuracy, only a little convergence. `residuals`: those at `x`.
    pub fn renew(&mut self, problem: &mut impl Problem, x: &[f64], residuals: &[f64], slots: Range<usize>) {
        let beside = Beside::new(problem, x, slots);
        let anew = (!problem.probes_alike()).then_some(x);
        let places: Vec<&[f64]> = beside.places.iter().map(Vec::as_slice).chain(anew).collect();
        let mut moved = vec![Vec::new(); places.len()];
        problem.probed_near(x, &places, &mut moved);
        let here = if anew.is_some() { &moved[places.len() - 1] } else { residuals };
        self.take(&beside, std::slice::from_ref(&here), &moved);
    }

    /// Takes the columns over from the residuals beside a place and there: the same for all, or for each its own.
    pub fn take(&mut self, beside: &Beside, here: &[impl AsRef<[f64]>], moved: &[Vec<f64>]) {
        for (k, (slots, moved)) in beside.moved.iter().zip(moved).enumerate() {
            let here = here[k.min(here.len() - 1)].as_ref();
            for (slot, step) in slots {
                let rows = self.rows(*slot, here.len());
                let column = &mut self.columns[*slot];
                column.clear();
                column.resize(here.len(), 0.0);
                for k in rows.into_iter().flatten() {
                    column[k] = (moved[k] - here[k]) / step;
                }
            }
        }
    }

    /// The residuals of all that a number moves.
    fn rows(&self, slot: usize, all: usize) -> [Range<usize>; 2] {
        match &self.few[slot] {
            None => [0..all, all..all],
            Some((rows, prior)) => [rows.clone(), *prior..prior + 1],
        }
    }

    /// Adds a multiple of the column of a number.
    pub fn add(&self, slot: usize, factor: f64, to: &mut [f64]) {
        for rows in self.rows(slot, to.len()) {
            add(&self.columns[slot][rows.clone()], factor, &mut to[rows]);
        }
    }

    /// The product of the column of a number and another vector.
    fn product(&self, slot: usize, other: &[f64]) -> f64 {
        let product = |rows: Range<usize>| dot(&self.columns[slot][rows.clone()], &other[rows]);
        self.rows(slot, other.len()).map(product).iter().sum()
    }

    /// Corrects the columns by what a step really did, each number measured by its own effect; those of numbers that move few residuals
    /// stay.
    pub fn follow(&mut self, step: &[f64], before: &[f64], after: &[f64]) {
        let mut error: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
        (0..step.len()).for_each(|slot| self.add(slot, -step[slot], &mut error));
        let many: Vec<usize> = (0..step.len()).filter(|slot| self.few[*slot].is_none()).collect();
        let weights: Vec<f64> = many.iter().map(|slot| self.product(*slot, &self.columns[*slot])).collect();
        let length: f64 = many.iter().zip(&weights).map(|(slot, w)| w * step[*slot] * step[*slot]).sum();
        for (slot, weight) in many.iter().zip(&weights).filter(|_| length > 0.0) {
            add(&error, weight * step[*slot] / length, &mut self.columns[*slot]);
        }
    }

    /// The normal matrix JᵀJ.
    pub fn normal(&self) -> DMatrix<f64> {
        let n = self.columns.len();
        let mut normal = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let sum = match (&self.few[i], &self.few[j]) {
                    (Some(_), Some(_)) if i != j => 0.0,
                    (None, Some(_)) => self.product(j, &self.columns[i]),
                    _ => self.product(i, &self.columns[j]),
                };
                normal[(i, j)] = sum;
                normal[(j, i)] = sum;
            }
        }
        normal
    }

    /// Half of the gradient of the cost, Jᵀr.
    pub fn gradient(&self, residuals: &[f64]) -> DVector<f64> {
        DVector::from_fn(self.columns.len(), |slot, _| self.product(slot, residuals))
    }
}

/// Adds a multiple of one vector to another.
fn add(vector: &[f64], factor: f64, to: &mut [f64]) {
    to.iter_mut().zip(vector).for_each(|(to, value)| *to += factor * value);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two runs of three samples that share a slope, each with a start of its own, which has a prior.
    struct Runs;

    impl Problem for Runs {
        fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>) {
            let sample = |k: usize| x[0] * (k as f64 + 1.0) + x[1 + k / 3] * 0.5f64.powi((k % 3) as i32);
            *out = (0..6).map(sample).chain([x[1], x[2]]).collect();
        }

        fn bounds(&self, _: usize) -> (f64, f64) {
            (-10.0, 10.0)
        }

        fn step(&self, _: usize) -> f64 {
            0.25
        }

        fn few(&self, slot: usize) -> Option<Few> {
            [None, Some((0..3, 6)), Some((3..6, 7))][slot].clone()
        }

        fn bending(&self) -> usize {
            1
        }
    }

    /// The same without saying what is few.
    struct Plain;

    impl Problem for Plain {
        fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>) {
            Runs.residuals(x, out);
        }

        fn bounds(&self, slot: usize) -> (f64, f64) {
            Runs.bounds(slot)
        }

        fn step(&self, slot: usize) -> f64 {
            Runs.step(slot)
        }

        fn bending(&self) -> usize {
            1
        }
    }

    #[test]
    fn numbers_of_one_run_each_move_together_and_give_the_same_derivatives() {
        let x = [1.0, 2.0, 3.0];
        assert_eq!(
            (Beside::new(&Runs, &x, 0..3).places.len(), Beside::new(&Plain, &x, 0..3).places.len()),
            (2, 3)
        );
        let (few, plain) = (Jacobian::probed(&mut Runs, &x), Jacobian::probed(&mut Plain, &x));
        assert_eq!(few.columns, plain.columns);
        assert_eq!(few.normal(), plain.normal());
        let residuals: Vec<f64> = (0..8).map(f64::from).collect();
        assert_eq!(few.gradient(&residuals), plain.gradient(&residuals));
        let mut renewed = Jacobian::new(&Runs, vec![Vec::new(); 3]);
        let mut here = Vec::new();
        Runs.residuals(&x, &mut here);
        renewed.renew(&mut Runs, &x, &here, 0..3);
        assert_eq!(renewed.columns, plain.columns);
    }
}
