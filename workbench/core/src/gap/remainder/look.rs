//! Is anything but noise left, and what does it look like?

use super::turn;
use crate::gap::dataset::Part;
use crate::gap::remainder::structure::Structure;
use crate::gap::residual::inflation;
use crate::gap::samples::{Sample, samples};
use crate::gap::search::Scored;
use std::f64::consts::{PI, TAU};

/// Quantile bins of an axis.
const BINS: usize = 24;
/// Lines that are looked for in time or position.
const LINES: usize = 500;
/// A line that explains so much of the residual is worth a name.
const LINE_SHARE: f64 = 0.3;
/// An axis that explains so much of the residual shows structure.
const AXIS_SHARE: f64 = 0.1;

/// What is left is looked at more closely from this mean square beyond the noise on, in units of the noise's variance.
const WORTH_A_LOOK: f64 = 0.05;

/// What two runs have in common counts from so many of its standard errors.
const CERTAIN: f64 = 3.0;

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
    let seen = samples(&scored.hypothesis, &scored.fit.x, &[Part::A, Part::B]);
    let residual: Vec<f64> = seen.iter().map(|s| s.residual() * s.weight).collect();
    let mean_square = residual.iter().map(|r| r * r).sum::<f64>() / residual.len().max(1) as f64;
    let common = common_square(scored, &seen);
    if let Some(differing) = unrepeated(scored, &seen) {
        return Remainder {
            excess: (mean_square - 1.0).max(0.0),
            repeated: true,
            structure: Structure::Unrepeatable { times: differing },
        };
    }
    // Without a repeat, the noise model decides; its error is covered by what counts as visible.
    let (excess, error) = common.unwrap_or((mean_square - 1.0, 0.0));
    let excess = if excess > CERTAIN * error { excess.max(0.0) } else { 0.0 };
    let structure = || described(&seen, &residual, scored.hypothesis.dataset.linear);
    // Below what a verdict calls left, nobody asks.
    let turning = (excess > WORTH_A_LOOK).then(|| turn::goes_with(scored, &seen, &residual)).flatten();
    Remainder { excess, repeated: common.is_some(), structure: turning.unwrap_or_else(structure) }
}

/// Inflation from which the difference of two runs with the same input is no sensor noise: it has a cause that the input
/// does not repeat. First-order noise with a coefficient of 0.75 inflates the variance of means sevenfold.
const SLOW: f64 = 7.0;
/// That difference must also be this much larger than the noise.
const BEYOND_NOISE: f64 = 1.3;

/// True if the difference of two runs with the same input may be the sensor's noise.
pub fn sensor_like(differences: &[f64]) -> bool {
    inflation(differences) < SLOW
}

/// By how much two runs with the same input differ, in units of the noise, if that is not the sensor.
fn unrepeated(scored: &Scored, seen: &[Sample]) -> Option<f64> {
    let weighted = |s: &Sample| s.residual() * s.weight;
    let pairs = twin_pairs(seen, &scored.hypothesis.dataset.twins, weighted);
    let differences: Vec<f64> = pairs.map(|(p, q)| (p - q) / 2f64.sqrt()).collect();
    let size = crate::gap::residual::rms(&differences);
    (differences.len() > 200 && size > BEYOND_NOISE && !sensor_like(&differences)).then_some(size)
}

/// The mean product of the residuals of two runs with the same input, and its standard error: what both have in common
/// is not noise.
fn common_square(scored: &Scored, seen: &[Sample]) -> Option<(f64, f64)> {
    let twins = &scored.hypothesis.dataset.twins;
    let weighted = |s: &Sample| s.residual() * s.weight;
    let products: Vec<f64> = twin_pairs(seen, twins, weighted).map(|(p, q)| p * q).collect();
    if products.len() <= 50 {
        return None;
    }
    let n = products.len() as f64;
    let mean = products.iter().sum::<f64>() / n;
    let scatter: Vec<f64> = products.iter().map(|p| p - mean).collect();
    let square = scatter.iter().map(|s| s * s).sum::<f64>() / n;
    Some((mean, (square * inflation(&scatter) / n).sqrt()))
}

/// A value of the samples at the same time in both of two runs.
pub fn twin_pairs<'s>(
    seen: &'s [Sample],
    twins: &'s [(usize, usize)],
    value: impl Fn(&Sample) -> f64 + Copy + 's,
) -> impl Iterator<Item = (f64, f64)> + 's {
    let of = move |run: usize| seen.iter().filter(move |s| s.run == run);
    twins.iter().flat_map(move |twins| {
        let mut second = of(twins.1).peekable();
        of(twins.0).filter_map(move |a| {
            while second.peek().is_some_and(|b| b.time < a.time - 1e-6) {
                second.next();
            }
            let b = second.peek().filter(|b| b.time < a.time + 1e-6)?;
            Some((value(a), value(b)))
        })
    })
}

/// The strongest structure.
fn described(seen: &[Sample], residual: &[f64], linear: bool) -> Structure {
    if residual.len() < 200 {
        return Structure::None;
    }
    let strong = |value| line(seen, residual, value).filter(|line| line.1 > LINE_SHARE);
    if let Some((frequency, share)) = strong(&|s| s.time) {
        return Structure::PeriodicInTime { hertz: frequency / TAU, share };
    }
    if let Some((number, share)) = strong(&|s| s.position) {
        return Structure::PeriodicInPosition { number, linear, share };
    }
    let chance = 2.0 * BINS as f64 * inflation(residual) / residual.len() as f64;
    let (quantity, share) = best_axis(seen, residual);
    if share > AXIS_SHARE.max(chance.min(0.5)) {
        return Structure::FunctionOf { quantity, share };
    }
    if inflation(residual) > 2.0 { Structure::Correlated } else { Structure::None }
}

/// The model quantity that explains most of the residual, and its share.
fn best_axis(seen: &[Sample], residual: &[f64]) -> (&'static str, f64) {
    type Quantity = fn(&Sample) -> f64;
    let axes: [(&'static str, Quantity); 5] = [
        ("the input", |s| s.input),
        ("the speed", |s| s.omega),
        ("the acceleration", |s| s.acceleration),
        ("the current", |s| s.current.abs()),
        ("the position", |s| s.position),
    ];
    let shares = axes.map(|(name, value)| (name, share_over(seen, residual, &value)));
    shares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("five axes")
}

/// Share of the residual's square that its means over bins of an axis explain, corrected for their number.
fn share_over(seen: &[Sample], residual: &[f64], value: &dyn Fn(&Sample) -> f64) -> f64 {
    let mut order: Vec<usize> = (0..residual.len()).collect();
    order.sort_by(|a, b| value(&seen[*a]).total_cmp(&value(&seen[*b])));
    let size = residual.len().div_ceil(BINS);
    let total: f64 = residual.iter().map(|r| r * r).sum();
    let explained: f64 = order
        .chunks(size)
        .map(|bin| bin.iter().map(|k| residual[*k]).sum::<f64>().powi(2) / bin.len() as f64)
        .sum();
    let n = residual.len() as f64;
    1.0 - (1.0 - explained / total) * n / (n - BINS as f64)
}

/// The strongest line over an axis: its circular frequency and the share of the residual's square.
fn line(seen: &[Sample], residual: &[f64], value: &dyn Fn(&Sample) -> f64) -> Option<(f64, f64)> {
    let values: Vec<f64> = seen.iter().map(value).collect();
    let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    if high - low < 1e-9 {
        return None;
    }
    let unit = PI / (high - low);
    let turns: Vec<(f64, f64)> = values.iter().map(|v| (unit * v).sin_cos()).collect();
    let mut now = vec![(0.0, 1.0); turns.len()];
    let total: f64 = residual.iter().map(|r| r * r).sum();
    let mut best = (0.0, 0.0);
    for harmonic in 1..=LINES {
        let (mut s, mut c) = (0.0, 0.0);
        for ((wave, turn), r) in now.iter_mut().zip(&turns).zip(residual) {
            *wave = (wave.0 * turn.1 + wave.1 * turn.0, wave.1 * turn.1 - wave.0 * turn.0);
            s += wave.0 * r;
            c += wave.1 * r;
        }
        let share = 2.0 * (s * s + c * c) / residual.len() as f64 / total;
        // Fewer than three periods are a drift, not a line.
        if harmonic >= 6 && share > best.1 {
            best = (harmonic as f64 * unit, share);
        }
    }
    Some(best)
}
