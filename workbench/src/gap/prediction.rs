//! Measured values beside those that a hypothesis predicts.

use crate::gap::dataset::{Part, Traces};
use crate::gap::fit::FINE;
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
        let plant = hypothesis.plant(x);
        let mut traces = Traces::default();
        let mut all = Vec::new();
        let mut made = Self {
            time: Vec::new(),
            measured: Vec::new(),
            predicted: Vec::new(),
        };
        for (index, run) in hypothesis.bench.runs.iter().enumerate() {
            run.simulate(&plant, hypothesis.start_speed(index, x), FINE, &mut traces);
            run.speed
                .predict(&run.time, &traces.reading, &traces.integral, &mut all);
            for k in (0..all.len()).filter(|k| parts.contains(&run.speed.part[*k])) {
                made.time.push(run.speed.time[k]);
                made.measured.push(run.speed.measured[k]);
                made.predicted.push(all[k]);
            }
        }
        made
    }

    /// Root mean square of measured minus predicted.
    pub fn gap(&self) -> f64 {
        let residual: Vec<f64> = self
            .measured
            .iter()
            .zip(&self.predicted)
            .map(|(y, p)| y - p)
            .collect();
        rms(&residual)
    }
}

/// Sums of squared residuals of each held-out record, in the order of the records: what a person sees of a prediction, without
/// weights. Where no record was given, the held-out part of the log is the one.
pub fn held_out_errors(hypothesis: &Hypothesis, x: &[f64]) -> Vec<f64> {
    let plant = hypothesis.plant(x);
    let (mut traces, mut predicted) = (Traces::default(), Vec::new());
    let mut sums = std::collections::BTreeMap::new();
    for (index, run) in hypothesis.bench.runs.iter().enumerate() {
        if !run.speed.part.contains(&Part::HoldOut) {
            continue;
        }
        run.simulate(&plant, hypothesis.start_speed(index, x), FINE, &mut traces);
        run.speed
            .predict(&run.time, &traces.reading, &traces.integral, &mut predicted);
        let held_out = (0..predicted.len()).filter(|k| run.speed.part[*k] == Part::HoldOut);
        let square = |k: usize| (run.speed.measured[k] - predicted[k]).powi(2);
        *sums.entry(run.log).or_insert(0.0) += held_out.map(square).sum::<f64>();
    }
    // A simulation that ran away is as wrong as can be.
    sums.into_values()
        .map(|sum: f64| if sum.is_nan() { f64::INFINITY } else { sum })
        .collect()
}
