//! Is anything but noise left, and what does it look like?

use super::left::Left;
use super::structure::Structure;
use super::turn;
use crate::gap::dataset::Dataset;
use crate::gap::fit::samples::Sample;
use crate::gap::fit::scored::Scored;
use crate::gap::residual::{inflation, rms};

/// Mean square beyond the noise, in units of the noise's variance, from which what is left is looked at more closely:
/// below what a verdict calls left, nobody asks. Chosen by judgement; not studied.
const CLOSELY: f64 = 0.05;

/// What two runs have in common counts from so many of its standard errors. Chosen by judgement: 99.7 % of what is
/// chance lies below.
const CERTAIN: f64 = 3.0;
/// Inflation from which the difference of two runs with the same input is no sensor noise: it has a cause that the
/// input does not repeat. Origin: first-order noise with a coefficient of 0.75 inflates the variance of means
/// sevenfold.
const SLOW: f64 = 7.0;
/// That difference must also be this much larger than the noise. Chosen by judgement; not studied.
const BEYOND_NOISE: f64 = 1.3;
/// Samples of two runs with the same input from which their difference tells anything. Chosen by judgement; not
/// studied.
const PAIRS: usize = 200;

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
