//! Measured values beside those that a hypothesis predicts.

use crate::gap::dataset::{Dataset, FINE, FullPass, GridRun, Part};
use crate::gap::fit::hypothesis::Hypothesis;
use crate::gap::fit::scored::Scored;
use crate::gap::residual::{fit_percent, rms};
use crate::outcome::{HoldOut, Step};
use crate::system::effects::Effect;
use crate::system::plant::physics::Physics;
use crate::text::figures::gap;

/// Measured and predicted values of some parts, in order.
#[derive(Clone, Debug, Default)]
pub struct Prediction {
    /// Time, s; of settled speeds there is none.
    pub time: Vec<f64>,
    /// Measured.
    pub measured: Vec<f64>,
    /// Simulated, through the sensor's window.
    pub predicted: Vec<f64>,
}

impl Prediction {
    /// Simulates finely and collects the samples of the given parts.
    pub fn of(hypothesis: &Hypothesis, x: &[f64], parts: &[Part]) -> Self {
        let mut prediction = Self::default();
        hypothesis.simulated(x, &hypothesis.plant(x), |index, _, all| {
            let probes = &hypothesis.dataset.runs[index].speed;
            for k in (0..all.len()).filter(|k| parts.contains(&probes.part[*k])) {
                prediction.time.push(probes.time[k]);
                prediction.measured.push(probes.measured[k]);
                prediction.predicted.push(all[k]);
            }
        });
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

/// What is told of a prediction of held-out data.
#[derive(Clone, Copy, Debug)]
pub struct HeldOut {
    /// Root mean square of measured minus predicted.
    pub gap: f64,
    /// Share of the measured variation that is predicted, %.
    pub fit_percent: f64,
}

impl HeldOut {
    /// Of a set; on all rows of a long log.
    pub fn of(full: Option<&FullPass>, set: &Scored) -> Self {
        match full {
            Some(full) => Self::of_all(full, &set.plant()),
            None => Prediction::of(&set.hypothesis, &set.fit.x, &[Part::HoldOut]).into(),
        }
    }

    fn of_all(whole: &FullPass, plant: &Physics) -> Self {
        let sums = whole.each(true, |_, run, simulation| {
            let (_, predicted) = simulation.speed(run, plant, run.start_speed, FINE);
            let held_out = (0..predicted.len()).filter(|k| run.speed.part[*k] == Part::HoldOut);
            held_out.fold([0.0; 4], |[n, off, sum, square], k| {
                let (y, e) = (run.speed.measured[k], run.speed.measured[k] - predicted[k]);
                [n + 1.0, off + e * e, sum + y, square + y * y]
            })
        });
        let add = |all: [f64; 4], one: [f64; 4]| std::array::from_fn(|k| all[k] + one[k]);
        let [n, off, sum, square] = sums.into_iter().fold([0.0; 4], add);
        let variation = (square - sum * sum / n.max(1.0)).max(1e-300);
        Self { gap: (off / n.max(1.0)).sqrt(), fit_percent: 100.0 * (1.0 - (off / variation).sqrt()) }
    }
}

impl From<Prediction> for HeldOut {
    fn from(prediction: Prediction) -> Self {
        let fit_percent = fit_percent(&prediction.measured, &prediction.predicted);
        Self { gap: prediction.gap(), fit_percent }
    }
}

/// Root mean square by which a set misses the logged position of the held-out records in free run, each run from its first row; `None`
/// where no position is logged, where it is what is compared anyhow, and of a long log.
pub fn position_gap(set: &Scored) -> Option<f64> {
    let dataset = set.hypothesis.dataset;
    if !dataset.position_logged || dataset.of_position || dataset.searched.is_some() {
        return None;
    }
    let mut misses = Vec::new();
    set.hypothesis.simulated_some(
        &set.fit.x,
        &set.plant(),
        |run| run.log > 0,
        |index, traces, _| {
            let position = &dataset.runs[index].position;
            let start = position[0] - traces.integral[0];
            misses.extend(traces.integral.iter().zip(position).map(|(place, at)| at - start - place));
        },
    );
    (!misses.is_empty()).then(|| rms(&misses))
}

/// How well measured values are predicted before and after.
pub fn compared(signal: &str, noise_floor: f64, before: HeldOut, after: HeldOut) -> HoldOut {
    HoldOut {
        signal: signal.to_owned(),
        rmse_before: before.gap,
        rmse_after: after.gap,
        noise_floor,
        fit_percent_before: before.fit_percent,
        fit_percent_after: after.fit_percent,
    }
}

/// The measured variation of all held-out samples: the sum of squares about their mean, from which the fit in percent is counted.
pub fn held_out_variation(dataset: &Dataset) -> f64 {
    let held_out = |run: &GridRun| {
        let parts = run.speed.part.iter().zip(&run.speed.measured);
        parts.filter(|(part, _)| **part == Part::HoldOut).map(|(_, y)| *y).collect::<Vec<f64>>()
    };
    let measured: Vec<f64> = dataset.runs.iter().flat_map(held_out).collect();
    let mean = measured.iter().sum::<f64>() / measured.len().max(1) as f64;
    measured.iter().map(|y| (y - mean).powi(2)).sum()
}

/// Why an effect is named.
pub fn sentence(effect: &Effect, before: &Step, after: &Step, unit: &str) -> String {
    let (from, to) = (gap(before.gap), gap(after.gap));
    let (summary, trace) = (effect.summary, effect.signature);
    if from == to || after.gap >= before.gap {
        return format!(
            "It lowers the held-out gap together with the other names, not alone ({from} and {to} {unit}): {summary}. It shows as: {trace}."
        );
    }
    format!("The held-out gap falls from {from} to {to} {unit} with it: {summary}. It shows as: {trace}.")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(before: f64, after: f64) -> String {
        let step = |gap: f64| Step { label: String::new(), gap };
        sentence(crate::system::effects::LIBRARY[0], &step(before), &step(after), "rad/s")
    }

    #[test]
    fn a_gap_falls_only_where_it_falls() {
        assert!(said(1.6, 1.5).contains("falls from 1.600 to 1.500 rad/s"));
        assert!(!said(1.5381, 1.5379).contains("falls"), "the same figure twice");
        assert!(!said(0.6725, 0.6823).contains("falls"));
    }
}
