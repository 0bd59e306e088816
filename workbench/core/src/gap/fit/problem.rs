//! What the solver minimises.

use std::ops::Range;

/// The residuals that a number moves: a stretch of them, and its prior.
pub type Few = (Range<usize>, usize);

/// What is minimised: the sum of the squares of residuals over numbers with bounds.
pub trait Problem {
    /// The residuals, each over its standard deviation: the compared samples first, the priors last.
    fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>);

    /// The residuals at several places near one of them, which may be cheaper together.
    fn residuals_near(&mut self, _x: &[f64], many: &[&[f64]], out: &mut [Vec<f64>]) {
        many.iter().zip(out).for_each(|(x, out)| self.residuals(x, out));
    }

    /// The residuals at several places near another one, as finely as a derivative there needs them.
    fn probed_near(&mut self, x: &[f64], many: &[&[f64]], out: &mut [Vec<f64>]) {
        self.residuals_near(x, many, out);
    }

    /// True if [`Self::probed_near`] gives what [`Self::residuals`] gives.
    fn probes_alike(&self) -> bool {
        true
    }

    /// Lower and upper bound of a number.
    fn bounds(&self, slot: usize) -> (f64, f64);

    /// Step of the numeric derivative of a number.
    fn step(&self, slot: usize) -> f64;

    /// The residuals that a number moves, if they are few, as with the start of one run of many. No residual is moved by two such numbers,
    /// and they stand in the order of their residuals.
    fn few(&self, _slot: usize) -> Option<Few> {
        None
    }

    /// So many numbers at the front bend the residuals so much that their derivatives are computed anew before each step.
    fn bending(&self) -> usize;
}

/// Does something with the widest registers of this processor. The numbers are the same as without.
pub fn in_registers<T>(work: impl FnOnce() -> T) -> T {
    pulp::Arch::new().dispatch(work)
}

/// Sums that are added up side by side: one alone would wait for itself. Chosen by judgement; not studied.
const ABREAST: usize = 16;

/// Sum of products.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    in_registers(|| sum_of_products(a, b))
}

#[inline(always)]
fn sum_of_products(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; ABREAST];
    let (heads, tails) = (a.chunks_exact(ABREAST).zip(b.chunks_exact(ABREAST)), a.len() / ABREAST * ABREAST);
    for (x, y) in heads {
        for k in 0..ABREAST {
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
