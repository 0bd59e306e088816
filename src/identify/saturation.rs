//! Saturation level of one direction: the equivalent input at which more command brings no more speed.
//!
//! A window at high voltage says which terminal voltage its motion needs, v̂ = (a + αw + δj)/β + d. Where the applied
//! voltage exceeds v̂ by more than the margin, v̂ is a sample of the level.

/// Least excess of the applied over the needed voltage that counts as saturation, Q20 of nominal: 2.5 %. Model error of
/// real motors (drag, unequal gain) reaches 1.5 %.
const MARGIN: i32 = 26_214;
/// Samples of the level before it is declared.
const LEAST_HITS: u16 = 4;
/// Weight of a new sample never falls below 1/1024, so that the level follows.
const LEAST_WEIGHT_RECIPROCAL: i32 = 1024;

/// What is known about one direction's level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    level: i32,
    deviation: i32,
    hits: u16,
    windows: u16,
}

impl State {
    /// Notes one window at high voltage, both magnitudes Q20 of nominal. `sigma`: standard deviation of `needed`.
    pub fn note(&mut self, applied: i32, needed: i32, sigma: i32) {
        let margin = MARGIN.max(sigma.saturating_mul(3));
        self.windows = self.windows.saturating_add(1);
        let informative = self.hits == 0 || applied > self.level.saturating_add(margin);
        if !informative || applied.saturating_sub(needed) <= margin {
            return;
        }
        self.hits = self.hits.saturating_add(1);
        let weight = i32::from(self.hits).min(LEAST_WEIGHT_RECIPROCAL);
        let error = needed.saturating_sub(self.level);
        self.level = self.level.saturating_add(error / weight);
        self.deviation = self
            .deviation
            .saturating_add((error.saturating_abs() - self.deviation) / weight);
    }

    /// The level, Q20 of nominal, once enough samples, and a quarter of all high windows, agree that there is one.
    pub fn level(&self) -> Option<i32> {
        (self.hits >= LEAST_HITS && self.hits >= self.windows / 4).then_some(self.level)
    }

    /// Mean deviation of the samples, Q20.
    pub fn deviation(&self) -> i32 {
        self.deviation
    }

    /// Were there windows at high voltage at all?
    pub fn tested(&self) -> bool {
        self.windows >= LEAST_HITS
    }
}
