//! Did friction and load stay what they were? The rows once more, summed by time slice.
//!
//! A least-squares deviation takes the rows for independent. Random torque, position-dependent friction and a load that
//! steps all make neighbouring rows err alike. With the solution known, the mean residual of each slice follows from
//! the slice's sums of columns, without a second pass over the data. Slices that disagree by more than independent
//! rows could widen the uncertainty (the cluster-robust variance of Liang & Zeger 1986, with slices as clusters).

use super::positive::Positive;
use super::regression::{COLUMNS, Row};
use super::solve::{COEFFICIENT_FRAC, Solution};
use crate::units::Direction;

/// Slices of the learning segments, both directions together; the verification adds one a direction.
pub const LEARN_SLICES: usize = 16;
/// First slice of the verification.
pub const VERIFY_SLICE: usize = LEARN_SLICES;
/// Slices of one commissioning.
pub const SLICES: usize = LEARN_SLICES + 2;
/// None of them has rows: one constant, so that it is put in place in one go.
pub const NO_SLICES: [Slice; SLICES] = [Slice::EMPTY; SLICES];
/// Rows are summed in Q14, so 2¹⁶ of them fit into 32 bits.
const SUM_SHIFT: u32 = 6;
const HALF: i32 = 1 << (SUM_SHIFT - 1);
/// Rows below which a slice says nothing.
const LEAST_ROWS: i32 = 6;
/// Largest mean residual that is reported, Q20: keeps its square in 64 bits.
const MOST_RESIDUAL: i64 = 1 << 24;

/// Sums of the columns of the rows of one slice.
#[derive(Clone, Copy, Debug, Default)]
pub struct Slice {
    sums: [i32; COLUMNS],
    rows: u16,
    direction: Direction,
    outer: bool,
}

impl Slice {
    /// Without rows.
    pub const EMPTY: Self =
        Self { sums: [0; COLUMNS], rows: 0, direction: Direction::Positive, outer: false };

    /// Adds one row of `direction`, unless it already holds rows of the other one; `outer`: above the core limit.
    #[inline]
    pub fn add(&mut self, row: &Row, direction: Direction, outer: bool) {
        if self.rows > 0 && self.direction != direction {
            return;
        }
        self.outer |= outer;
        for (sum, &column) in self.sums.iter_mut().zip(&row.0) {
            // Rounded: cut off, the sums would all lean to one side, by a hundredth of a volt on slow motors.
            *sum = sum.wrapping_add(column.saturating_add(HALF) >> SUM_SHIFT);
        }
        self.rows = self.rows.saturating_add(1);
        self.direction = direction;
    }

    /// Mean residual as a voltage, Q20 of nominal, positive: more voltage was needed than the solution says.
    pub fn residual(&self, solution: &Solution) -> Option<i32> {
        let rows = i32::from(self.rows);
        if rows < LEAST_ROWS {
            return None;
        }
        let direction = self.direction;
        let c = &solution.coefficients[direction];
        let mut torque = -(i64::from(self.sums[COLUMNS - 1]) << COEFFICIENT_FRAC);
        for (sum, coefficient) in self.sums.iter().zip([c.gamma, c.beta, c.alpha, c.delta]) {
            torque = torque.wrapping_add(i64::from(*sum) * i64::from(coefficient));
        }
        let torque =
            (torque >> (COEFFICIENT_FRAC - SUM_SHIFT)).clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        let mean = i64::from(torque as i32 / rows);
        let volts = (mean * i64::from(solution.inverse_beta[direction])) >> super::solve::INVERSE_FRAC;
        Some(volts.clamp(-MOST_RESIDUAL, MOST_RESIDUAL) as i32)
    }

    /// Rows in it.
    pub fn rows(&self) -> u16 {
        self.rows
    }

    /// Contains rows above the core limit.
    pub fn outer(&self) -> bool {
        self.outer
    }

    /// Direction of its rows.
    pub fn direction(&self) -> Direction {
        self.direction
    }
}

/// How the slices disagree.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spread {
    squares: Positive,
    rows: u32,
    slices: u32,
    /// Largest mean residual of a slice, Q20 of nominal.
    pub worst: i32,
}

impl Spread {
    /// Notes one slice's mean residual.
    pub fn note(&mut self, residual: i32, rows: u16) {
        let sum = Positive::of(residual, 20).times(Positive::new(u64::from(rows), 0));
        self.squares = self.squares.plus(sum.times(sum));
        self.rows = self.rows.saturating_add(u32::from(rows));
        self.slices = self.slices.saturating_add(1);
        self.worst = self.worst.max(residual.saturating_abs());
    }

    /// Factor by which the variance exceeds that of independent rows, at least 1. `row_variance`: of one row, as a
    /// squared voltage, overlap included. `unknowns` were fitted to the slices.
    pub fn inflation(&self, row_variance: Positive, unknowns: u32) -> Positive {
        let one = Positive::new(1, 0);
        if self.slices <= unknowns {
            return one;
        }
        let expected = row_variance.times(Positive::new(u64::from(self.rows), 0));
        let fitted = Positive::new(u64::from(self.slices), 0)
            .over(Positive::new(u64::from(self.slices - unknowns), 0));
        let factor = self.squares.over(expected).times(fitted);
        if factor.below(one) { one } else { factor }
    }
}
