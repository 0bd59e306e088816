//! Measured values beside those that a hypothesis predicts.

use crate::gap::dataset::{BenchRun, Part};
use crate::gap::hypothesis::Hypothesis;
use crate::gap::residual::rms;

/// Measured and predicted values of some parts, in order.
pub struct Prediction {
    /// Time, s.
    pub time: Vec<f64>,
    /// Measured.
    pub measured: Vec<f64>,
    /// Simulated, through the sensor's window.
    pub predicted: Vec<f64>,
}

impl Prediction {
    /// Simulates finely and collects the samples of the given parts.
    pub fn of(hypothesis: &Hypothesis, x: &[f64], parts: &[Part]) -> Self {
        let mut prediction = Self {
            time: Vec::new(),
            measured: Vec::new(),
            predicted: Vec::new(),
        };
        hypothesis.simulated(
            x,
            &hypothesis.plant(x),
            |_| true,
            |index, _, all| {
                let probes = &hypothesis.bench.runs[index].speed;
                for k in (0..all.len()).filter(|k| parts.contains(&probes.part[*k])) {
                    prediction.time.push(probes.time[k]);
                    prediction.measured.push(probes.measured[k]);
                    prediction.predicted.push(all[k]);
                }
            },
        );
        prediction
    }

    /// Measured minus predicted.
    pub fn residual(&self) -> Vec<f64> {
        let pairs = self.measured.iter().zip(&self.predicted);
        pairs.map(|(y, p)| y - p).collect()
    }

    /// Root mean square of measured minus predicted.
    pub fn gap(&self) -> f64 {
        rms(&self.residual())
    }
}

/// Sums of squared residuals of each held-out record, in the order of the records: what a person sees of a prediction, without
/// weights. Where no record was given, the held-out part of the log is the one.
pub fn held_out_errors(hypothesis: &Hypothesis, x: &[f64]) -> Vec<f64> {
    let mut sums = std::collections::BTreeMap::new();
    let held_out = |run: &BenchRun| run.speed.part.contains(&Part::HoldOut);
    hypothesis.simulated(x, &hypothesis.plant(x), held_out, |index, _, predicted| {
        let run = &hypothesis.bench.runs[index];
        let held_out = (0..predicted.len()).filter(|k| run.speed.part[*k] == Part::HoldOut);
        let square = |k: usize| (run.speed.measured[k] - predicted[k]).powi(2);
        *sums.entry(run.log).or_insert(0.0) += held_out.map(square).sum::<f64>();
    });
    // A simulation that ran away is as wrong as can be.
    sums.into_values()
        .map(|sum: f64| if sum.is_nan() { f64::INFINITY } else { sum })
        .collect()
}
