//! The weight of each compared sample: noise, and an error budget.
//!
//! At ten thousand samples everything is significant. A few per cent of a sample of timing and some 1e-4 of the value
//! are wrong in every log, so they belong to the weights.

use super::{Bench, Probes, Traces};
use crate::fit::COARSE;
use crate::plant::physics::Physics;

/// Timing error as a part of the sample period.
const TIMING: f64 = 0.02;
/// Error as a part of the value.
const VALUE: f64 = 3e-4;

impl Bench {
    /// Sets the weights from the noise and from a simulation's slopes (never the measurement's: they are noisy).
    pub fn weigh(&mut self, plant: &Physics) {
        let (sigma, sigma_current) = (self.sigma, self.sigma_current);
        let mut traces = Traces::default();
        let mut predicted = Vec::new();
        for run in &mut self.runs {
            run.simulate(plant, run.start_speed, COARSE, &mut traces);
            run.speed
                .predict(&run.time, &traces.reading, &traces.integral, &mut predicted);
            let sample = (run.row_time[run.row_time.len() - 1] - run.row_time[0]) / run.row_time.len() as f64;
            budget(&mut run.speed, &predicted, sigma, sample);
            if let Some(sigma) = sigma_current.filter(|_| !run.current.is_empty()) {
                run.current
                    .predict(&run.time, &traces.current, &traces.charge, &mut predicted);
                budget(&mut run.current, &predicted, sigma, sample);
            }
        }
    }
}

fn budget(probes: &mut Probes, predicted: &[f64], sigma: f64, sample: f64) {
    let last = predicted.len().saturating_sub(1);
    for k in 0..predicted.len() {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
        let span = (probes.time[after] - probes.time[before]).max(1e-12);
        let slope = (predicted[after] - predicted[before]) / span;
        let (timing, value) = (TIMING * sample * slope, VALUE * predicted[k]);
        probes.weight[k] = 1.0 / (sigma * sigma + timing * timing + value * value).sqrt();
    }
}
