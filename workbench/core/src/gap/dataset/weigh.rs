//! The weight of each compared sample: noise, and an error budget.
//!
//! At ten thousand samples everything is significant. A few per cent of a sample of timing and some 1e-4 of the value
//! are wrong in every log, so they belong to the weights.

use super::{Dataset, GridRun, Part, Probes, Simulation};
use crate::gap::dataset::{COARSE, FINE};
use crate::system::plant::physics::Physics;

/// Timing error as a part of the sample period. Chosen by judgement; not studied.
const TIMING: f64 = 0.02;
/// Error as a part of the value. Chosen by judgement; not studied.
const VALUE: f64 = 3e-4;

impl Dataset {
    /// The same dataset, weighed by a noise and by a simulation's slopes (never the measurement's: they are noisy).
    pub fn weighed(mut self, plant: &Physics, sigma: f64) -> Self {
        let sigma_current = self.sigma_current;
        self.sigma = sigma;
        let mut simulation = Simulation::default();
        for run in &mut self.runs {
            let sample = (run.row_time[run.row_time.len() - 1] - run.row_time[0]) / run.row_time.len() as f64;
            let (_, predicted) = simulation.speed(run, plant, run.start_speed, COARSE);
            budget(&mut run.speed, predicted, sigma, sample);
            if let Some(sigma) = sigma_current.filter(|_| !run.current.is_empty()) {
                let predicted = simulation.current(run);
                budget(&mut run.current, predicted, sigma, sample);
            }
        }
        self
    }

    /// The same dataset with one weight for all samples of a signal, by their mean variance: for a model that no log is near to.
    pub fn evenly_weighed(mut self) -> Self {
        let signals: [fn(&mut GridRun) -> &mut Probes; 2] = [|run| &mut run.speed, |run| &mut run.current];
        for signal in signals {
            let (mut variance, mut count) = (0f64, 0f64);
            for probes in self.runs.iter_mut().map(signal) {
                for k in (0..probes.part.len()).filter(|k| matches!(probes.part[*k], Part::A | Part::B)) {
                    (variance, count) = (variance + probes.weight[k].powi(-2), count + 1.0);
                }
            }
            let weight = (count / variance).sqrt();
            self.runs.iter_mut().map(signal).for_each(|probes| probes.weight.fill(weight));
        }
        self
    }

    /// The same dataset with the error of a model in the weights. Weights by noise alone let a model that is wrong by many
    /// times the noise fit the quiet stretches and miss the others.
    pub fn eased(&self, plant: &Physics, start_speed: impl Fn(usize) -> f64) -> Self {
        let mut eased = self.clone();
        let (mut speed, mut current) = (Squares::default(), Squares::default());
        let mut simulation = Simulation::default();
        for (index, run) in self.runs.iter().enumerate() {
            let (_, predicted) = simulation.speed(run, plant, start_speed(index), FINE);
            speed.add(&run.speed, predicted);
            if !run.current.is_empty() {
                current.add(&run.current, simulation.current(run));
            }
        }
        for run in &mut eased.runs {
            speed.ease(&mut run.speed);
            current.ease(&mut run.current);
        }
        eased
    }
}

/// Squares of residuals of one signal.
#[derive(Default)]
struct Squares {
    sum: f64,
    noise: f64,
    count: f64,
}

impl Squares {
    fn add(&mut self, probes: &Probes, predicted: &[f64]) {
        for (k, predicted) in predicted.iter().enumerate() {
            if matches!(probes.part[k], Part::A | Part::B) {
                self.sum += (probes.measured[k] - predicted).powi(2);
                self.noise += probes.weight[k].powi(-2);
                self.count += 1.0;
            }
        }
    }

    /// Adds what is beyond the noise to the variance of every sample.
    fn ease(&self, probes: &mut Probes) {
        let error = ((self.sum - self.noise) / self.count.max(1.0)).max(0.0);
        for weight in &mut probes.weight {
            *weight = 1.0 / (weight.powi(-2) + error).sqrt();
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
