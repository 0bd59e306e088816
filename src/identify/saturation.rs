//! Saturation level of one direction: the equivalent input at which more command brings no more speed.
//!
//! A window at high voltage says which terminal voltage its motion needs, v̂ = (a + αw + δj)/β + d. Where the applied
//! voltage exceeds v̂ by more than the margin, v̂ is a sample of the level. The sum over the samples is kept as the sum of
//! their columns, so that the level follows when later rows improve the solution.

use super::coast::Sums;
use super::solve::Solution;
use super::spline::Window;
use crate::units::Direction;

/// Least excess of the applied over the needed voltage that counts as saturation, Q20 of nominal: 2.5 %. Model error of
/// real motors (drag, unequal gain) reaches 1.5 %.
pub const MARGIN: i32 = 26_214;
/// Samples of the level before it is declared.
const LEAST_HITS: u16 = 4;

/// What is known about one direction's level.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    sums: Sums,
    level: i32,
    deviation: i32,
    /// Mean of the applied voltage over the samples, Q20.
    applied: i32,
    hits: u16,
    windows: u16,
}

/// What the evidence says about one direction's level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// The level, Q20 of nominal.
    pub level: Option<i32>,
    /// By how much the applied voltage exceeded it on average, Q20.
    pub excess: i32,
    /// Mean deviation of the samples, Q20.
    pub deviation: i32,
    /// There were windows at high voltage.
    pub tested: bool,
}

impl State {
    /// Notes one window at high voltage, `applied` and `needed` magnitudes, Q20 of nominal. `sigma`: standard deviation of
    /// `needed`.
    pub fn note(&mut self, window: &Window, direction: Direction, applied: i32, needed: i32, sigma: i32) {
        let margin = MARGIN.max(sigma.saturating_mul(3));
        self.windows = self.windows.saturating_add(1);
        let informative = self.hits == 0 || applied > self.level.saturating_add(margin);
        if !informative || applied.saturating_sub(needed) <= margin || self.hits == u16::MAX {
            return;
        }
        self.hits += 1;
        self.sums.note(window, if direction == Direction::Positive { 1 } else { -1 }, 0);
        let weight = i32::from(self.hits);
        self.applied = self.applied.saturating_add(applied.saturating_sub(self.applied) / weight);
        let error = needed.saturating_sub(self.level);
        self.level = self.level.saturating_add(error / weight);
        self.deviation = self.deviation.saturating_add((error.saturating_abs() - self.deviation) / weight);
    }

    /// The level, Q20 of nominal, once enough samples, and a quarter of all high windows, agree that there is one.
    pub fn level(&self, solution: &Solution, direction: Direction) -> Option<i32> {
        let seen = self.hits >= LEAST_HITS && self.hits >= self.windows / 4;
        seen.then(|| {
            let effective =
                self.sums.mean_voltage(&solution.coefficients[direction], solution.inverse_beta[direction]);
            effective.saturating_add(solution.dead_zone[direction])
        })
    }

    /// Summary for the decision.
    pub fn seen(&self, level: Option<i32>) -> Seen {
        Seen {
            level,
            excess: self.applied.saturating_sub(level.unwrap_or_default()),
            deviation: self.deviation,
            tested: self.windows >= LEAST_HITS,
        }
    }
}
