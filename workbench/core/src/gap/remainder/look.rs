//! Is anything but noise left, and what does it look like?

use super::structure::Structure;
use super::turn;
use crate::gap::dataset::{Dataset, Part};
use crate::gap::residual::{inflation, rms};
use crate::gap::samples::{Sample, samples};
use crate::gap::scored::Scored;
use crate::system::plant::unnamed::Variable;
use std::f64::consts::{PI, TAU};

/// Quantile bins of an axis.
const BINS: usize = 24;
/// Lines that are looked for in time or position.
const LINES: usize = 500;
/// A line that explains so much of the residual is told.
const LINE_SHARE: f64 = 0.3;
/// An axis that explains so much of the residual shows structure.
const AXIS_SHARE: f64 = 0.1;

/// What is left is looked at more closely from this mean square beyond the noise on, in units of the noise's variance: below what
/// a verdict calls left, nobody asks.
const CLOSELY: f64 = 0.05;

/// What two runs have in common counts from so many of its standard errors.
const CERTAIN: f64 = 3.0;
/// Inflation from which the difference of two runs with the same input is no sensor noise: it has a cause that the input
/// does not repeat. First-order noise with a coefficient of 0.75 inflates the variance of means sevenfold.
const SLOW: f64 = 7.0;
/// That difference must also be this much larger than the noise.
const BEYOND_NOISE: f64 = 1.3;
/// Samples of two runs with the same input from which their difference tells anything.
const PAIRS: usize = 200;
/// Samples of a log from which a structure is looked for.
pub(super) const SAMPLES: usize = 200;
/// Quantities that may explain what is left.
const AXES: [Variable; 5] =
    [Variable::Input, Variable::Speed, Variable::Acceleration, Variable::Current, Variable::Position];

/// What is left of a fit.
#[derive(Clone, Debug)]
pub struct Remainder {
    /// Mean square beyond the noise, in units of the noise's variance. With a repeated input it needs no noise model.
    pub excess: f64,
    /// True if two runs with the same input measured it.
    pub repeated: bool,
    /// What it looks like.
    pub structure: Structure,
}

/// Looks at what a fit leaves.
pub fn look(scored: &Scored) -> Remainder {
    let left = Left::of(scored);
    let mean_square = left.square() / left.residual.len().max(1) as f64;
    let pairs = twin_pairs(&left.seen, scored.hypothesis.dataset, |s| s.residual() * s.weight);
    if let Some(times) = unrepeated(&pairs) {
        let structure = Structure::Unrepeatable { times };
        return Remainder { excess: (mean_square - 1.0).max(0.0), repeated: true, structure };
    }
    // Without a repeat, the noise model decides; its error is covered by what counts as visible.
    let common = common_square(&pairs);
    let (excess, error) = common.unwrap_or((mean_square - 1.0, 0.0));
    let excess = if excess > CERTAIN * error { excess.max(0.0) } else { 0.0 };
    let turning = (excess > CLOSELY).then(|| turn::goes_with(&left)).flatten();
    Remainder { excess, repeated: common.is_some(), structure: turning.unwrap_or_else(|| left.structure()) }
}

/// True if the differences of two runs with the same input are many, and may be the sensor's noise.
pub fn sensor_like(differences: &[f64]) -> bool {
    differences.len() > PAIRS && inflation(differences) < SLOW
}

/// By how much two runs with the same input differ, in units of the noise, if that is not the sensor.
fn unrepeated(pairs: &[(f64, f64)]) -> Option<f64> {
    let differences: Vec<f64> = pairs.iter().map(|(p, q)| (p - q) / 2f64.sqrt()).collect();
    let size = rms(&differences);
    (pairs.len() > PAIRS && size > BEYOND_NOISE && !sensor_like(&differences)).then_some(size)
}

/// The mean product of the residuals of two runs with the same input, and its standard error: what both have in common
/// is not noise.
fn common_square(pairs: &[(f64, f64)]) -> Option<(f64, f64)> {
    if pairs.len() <= 50 {
        return None;
    }
    let n = pairs.len() as f64;
    let mean = pairs.iter().map(|(p, q)| p * q).sum::<f64>() / n;
    let scatter: Vec<f64> = pairs.iter().map(|(p, q)| p * q - mean).collect();
    let square = scatter.iter().map(|s| s * s).sum::<f64>() / n;
    Some((mean, (square * inflation(&scatter) / n).sqrt()))
}

/// A value of the samples at the same time in both of two runs with the same input.
pub fn twin_pairs(seen: &[Sample], dataset: &Dataset, value: impl Fn(&Sample) -> f64) -> Vec<(f64, f64)> {
    let of = |run: usize| seen.iter().filter(move |s| s.run == run);
    let mut pairs = Vec::new();
    for twins in &dataset.twins {
        let mut second = of(twins.1).peekable();
        for a in of(twins.0) {
            while second.next_if(|b| b.time < a.time - 1e-6).is_some() {}
            pairs.extend(second.peek().filter(|b| b.time < a.time + 1e-6).map(|b| (value(a), value(b))));
        }
    }
    pairs
}

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
    fn of(scored: &'s Scored<'a>) -> Self {
        let seen = samples(scored, &[Part::A, Part::B]);
        let residual = seen.iter().map(|s| s.residual() * s.weight).collect();
        Self { scored, seen, residual }
    }

    /// Sum of the squares.
    fn square(&self) -> f64 {
        self.residual.iter().map(|r| r * r).sum()
    }

    /// The strongest structure.
    fn structure(&self) -> Structure {
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
