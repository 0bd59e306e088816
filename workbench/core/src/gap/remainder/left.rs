//! What a fit leaves of the log, sample by sample, and the strongest structure in it.

use super::structure::Structure;
use crate::gap::dataset::Part;
use crate::gap::fit::samples::{Sample, samples};
use crate::gap::fit::scored::Scored;
use crate::gap::residual::inflation;
use crate::system::plant::unnamed::Variable;
use std::f64::consts::{PI, TAU};

/// Quantile bins of an axis. Chosen by judgement; not studied.
const BINS: usize = 24;
/// Lines that are looked for in time or position. Chosen by judgement; not studied.
const LINES: usize = 500;
/// A line that explains so much of the residual is told. Chosen by judgement; not studied.
const LINE_SHARE: f64 = 0.3;
/// An axis that explains so much of the residual shows structure. Chosen by judgement; not studied.
const AXIS_SHARE: f64 = 0.1;
/// Samples of a log from which a structure is looked for. Chosen by judgement; not studied.
pub(super) const SAMPLES: usize = 200;
/// Quantities that may explain what is left.
const AXES: [Variable; 5] =
    [Variable::Input, Variable::Speed, Variable::Acceleration, Variable::Current, Variable::Position];

/// What a fit leaves of the log, sample by sample.
pub(super) struct Left<'s, 'a> {
    /// The fitted set.
    pub scored: &'s Scored<'a>,
    /// The compared samples of the log.
    pub seen: Vec<Sample>,
    /// What is left of each, in its standard deviations.
    pub residual: Vec<f64>,
}

impl<'s, 'a> Left<'s, 'a> {
    /// Simulates a set.
    pub fn of(scored: &'s Scored<'a>) -> Self {
        let seen = samples(scored, &[Part::A, Part::B]);
        let residual = seen.iter().map(|s| s.residual() * s.weight).collect();
        Self { scored, seen, residual }
    }

    /// Sum of the squares.
    pub fn square(&self) -> f64 {
        self.residual.iter().map(|r| r * r).sum()
    }

    /// The strongest structure.
    pub fn structure(&self) -> Structure {
        if self.residual.len() < SAMPLES {
            return Structure::None;
        }
        let strong = |value| self.line(value).filter(|line| line.1 > LINE_SHARE);
        if let Some((frequency, share)) = strong(Variable::Time) {
            return Structure::PeriodicInTime { hertz: frequency / TAU, share };
        }
        if let Some((number, share)) = strong(Variable::Position) {
            let linear = self.scored.hypothesis.dataset.linear;
            return Structure::PeriodicInPosition { number, linear, share };
        }
        let correlated = inflation(&self.residual);
        let chance = 2.0 * BINS as f64 * correlated / self.residual.len() as f64;
        let shares = AXES.map(|quantity| (quantity, self.share_over(quantity)));
        let best = shares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        match best.filter(|(_, share)| *share > AXIS_SHARE.max(chance.min(0.5))) {
            Some((quantity, share)) => Structure::FunctionOf { quantity, share },
            None if correlated > 2.0 => Structure::Correlated,
            None => Structure::None,
        }
    }

    /// Share of the square that the means over quantile bins of an axis explain, corrected for their number.
    fn share_over(&self, axis: Variable) -> f64 {
        let n = self.residual.len();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| self.seen[*a].of(axis).total_cmp(&self.seen[*b].of(axis)));
        let mut bins = vec![0; n];
        order.iter().enumerate().for_each(|(rank, k)| bins[*k] = rank / n.div_ceil(BINS));
        let n = n as f64;
        1.0 - (1.0 - explained(&self.residual, bins)) * n / (n - BINS as f64)
    }

    /// The strongest line over an axis: its circular frequency and the share of the residual's square.
    fn line(&self, axis: Variable) -> Option<(f64, f64)> {
        let values: Vec<f64> = self.seen.iter().map(|s| s.of(axis)).collect();
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
        if high - low < 1e-9 {
            return None;
        }
        let unit = PI / (high - low);
        let turns: Vec<(f64, f64)> = values.iter().map(|v| (unit * v).sin_cos()).collect();
        let mut now = vec![(0.0, 1.0); turns.len()];
        let total = self.square();
        let mut best = (0.0, 0.0);
        for harmonic in 1..=LINES {
            let (mut s, mut c) = (0.0, 0.0);
            for ((wave, turn), r) in now.iter_mut().zip(&turns).zip(&self.residual) {
                *wave = (wave.0 * turn.1 + wave.1 * turn.0, wave.1 * turn.1 - wave.0 * turn.0);
                s += wave.0 * r;
                c += wave.1 * r;
            }
            let share = 2.0 * (s * s + c * c) / values.len() as f64 / total;
            // Fewer than three periods are a drift, not a line.
            if harmonic >= 6 && share > best.1 {
                best = (harmonic as f64 * unit, share);
            }
        }
        Some(best)
    }
}

/// Share of the square of some values that their means over bins explain.
pub(super) fn explained(values: &[f64], bins: impl IntoIterator<Item = usize>) -> f64 {
    let (mut sums, mut counts) = ([0.0; BINS], [0.0; BINS]);
    for (bin, value) in bins.into_iter().zip(values) {
        sums[bin] += value;
        counts[bin] += 1.0;
    }
    let total: f64 = values.iter().map(|value| value * value).sum();
    let bins = sums.iter().zip(&counts).filter(|(_, count)| **count > 0.0);
    bins.map(|(sum, count)| sum * sum / count).sum::<f64>() / total
}
