//! What a sensor sees of a simulated run: weighted sums of the reading's integral at given times.

use super::Part;
use crate::system::plant::simd::Lanes;

/// The samples of one compared signal of one run.
#[derive(Clone, Debug, Default)]
pub struct Probes {
    /// Time of each sample, s.
    pub time: Vec<f64>,
    /// Measured values.
    pub measured: Vec<f64>,
    /// One over the standard deviation of each sample, error budget included.
    pub weight: Vec<f64>,
    /// What each sample serves for.
    pub part: Vec<Part>,
    /// Block in which each sample lies: for the model quantities at that time.
    pub block: Vec<u32>,
    /// Of a compared position, the block at which the way of each sample begins; otherwise empty.
    pub from: Vec<u32>,
    /// First term of each sample in `terms`, and one past the last.
    ends: Vec<u32>,
    terms: Vec<Term>,
}

/// Coefficient times the integral of the reading at a time inside a block, or times the reading itself.
#[derive(Clone, Copy, Debug)]
struct Term {
    block: u32,
    /// 0 … 1 inside the block; negative: the reading at the block's start instead of the integral.
    fraction: f64,
    coefficient: f64,
}

/// Locates times on a grid.
pub struct Grid<'a>(pub &'a [f64]);

impl Grid<'_> {
    /// Block and fraction of a time. Times outside the grid are cut to it.
    pub fn locate(&self, time: f64) -> (u32, f64) {
        let time = time.clamp(self.0[0], self.0[self.0.len() - 1]);
        let block = self.0.partition_point(|start| *start <= time).clamp(1, self.0.len() - 1) - 1;
        let fraction = (time - self.0[block]) / (self.0[block + 1] - self.0[block]);
        // A time that is a grid point to rounding is that grid point.
        let snapped = if fraction < 1e-6 {
            0.0
        } else if fraction > 1.0 - 1e-6 {
            1.0
        } else {
            fraction
        };
        (block as u32, snapped)
    }
}

impl Probes {
    /// Adds a sample that is the mean over windows, each (from, to), all with the same weight.
    pub fn push_windows(&mut self, grid: &Grid, time: f64, measured: f64, windows: &[(f64, f64)]) {
        for (from, to) in windows {
            let coefficient = 1.0 / ((to - from) * windows.len() as f64);
            for (at, sign) in [(from, -1.0), (to, 1.0)] {
                let (block, fraction) = grid.locate(*at);
                self.terms.push(Term { block, fraction, coefficient: sign * coefficient });
            }
        }
        self.finish(grid, time, measured);
    }

    /// Adds a sample that is the reading at a time on the grid.
    pub fn push_instant(&mut self, grid: &Grid, time: f64, measured: f64) {
        let (block, fraction) = grid.locate(time);
        let block = if fraction > 0.5 { block + 1 } else { block };
        self.terms.push(Term { block, fraction: -1.0, coefficient: 1.0 });
        self.finish(grid, time, measured);
    }

    /// Adds a sample that is the way of the reading from the start of one block to the start of another.
    pub fn push_way(&mut self, grid: &Grid, from: usize, to: usize, measured: f64) {
        for (block, coefficient) in [(from, -1.0), (to, 1.0)] {
            let (block, fraction) = grid.locate(grid.0[block]);
            self.terms.push(Term { block, fraction, coefficient });
        }
        self.from.push(from as u32);
        self.finish(grid, grid.0[to], measured);
        *self.block.last_mut().expect("just added") = to as u32 - 1;
    }

    fn finish(&mut self, grid: &Grid, time: f64, measured: f64) {
        self.time.push(time);
        self.measured.push(measured);
        self.weight.push(1.0);
        self.part.push(Part::A);
        self.block.push(grid.locate(time).0);
        self.ends.push(self.terms.len() as u32);
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.measured.len()
    }

    /// Number of samples that serve for some of the parts.
    pub fn number_of(&self, parts: &[Part]) -> usize {
        self.part.iter().filter(|part| parts.contains(part)).count()
    }

    /// True without samples.
    pub fn is_empty(&self) -> bool {
        self.measured.is_empty()
    }

    /// What the sensor would have shown, from the reading and its integral at the grid's points; of several sets in lock-step
    /// side by side. `like`: any number, for its width. `predicted`: room for one number of each sample and set.
    #[inline(always)]
    pub fn predict<F: Lanes>(&self, like: F, time: &[f64], read: &[f64], integral: &[f64], to: &mut [f64]) {
        let mut first = 0;
        for (end, place) in self.ends.iter().zip(to.chunks_exact_mut(F::COUNT)) {
            let mut sum = like.like(0.0);
            for term in first..*end as usize {
                sum = sum + self.terms[term].value(like, time, read, integral);
            }
            sum.store(place);
            first = *end as usize;
        }
    }
}

impl Term {
    #[inline(always)]
    fn value<F: Lanes>(&self, like: F, time: &[f64], reading: &[f64], integral: &[f64]) -> F {
        let k = self.block as usize;
        let here = k * F::COUNT;
        let next = here + F::COUNT;
        if self.fraction < 0.0 {
            return like.load(&reading[here..]) * self.coefficient;
        }
        if self.fraction == 0.0 {
            return like.load(&integral[here..]) * self.coefficient;
        }
        if self.fraction == 1.0 {
            return like.load(&integral[next..]) * self.coefficient;
        }
        // Cubic Hermite: value and slope are known at both ends.
        let (s, h) = (self.fraction, time[k + 1] - time[k]);
        let (s2, s3) = (s * s, s * s * s);
        let (from, to) = (like.load(&integral[here..]), like.load(&integral[next..]));
        let bend = like.load(&reading[here..]) * ((s3 - 2.0 * s2 + s) * h)
            + like.load(&reading[next..]) * ((s3 - s2) * h);
        (from + (to - from) * (3.0 * s2 - 2.0 * s3) + bend) * self.coefficient
    }
}
