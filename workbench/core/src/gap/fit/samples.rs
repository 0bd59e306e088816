//! Measured, simulated and what the model does at each compared sample: what localisation, structure and plots look at.

use crate::gap::dataset::{FINE, FullPass, GridRun, Part, Traces};
use crate::gap::fit::scored::Scored;
use crate::system::plant::physics::Physics;
use crate::system::plant::unnamed::Variable;
use servo::axis::Bridge;

/// One compared sample with the model quantities at its time. Bins are made over these, never over the measurement:
/// a measured speed shares its noise with the residual.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Index of the run.
    pub run: usize,
    /// Time since the start of the run, s.
    pub time: f64,
    /// Measured value.
    pub measured: f64,
    /// Simulated value, through the sensor's window.
    pub predicted: f64,
    /// One over the standard deviation.
    pub weight: f64,
    /// Input command.
    pub input: f64,
    /// Simulated speed.
    pub omega: f64,
    /// Simulated acceleration.
    pub acceleration: f64,
    /// Simulated current.
    pub current: f64,
    /// Shaft position.
    pub position: f64,
    /// True while the bridge is open.
    pub open: bool,
    /// What the sample serves for.
    pub part: Part,
    /// Missing torque: J·de/dt + D·e, from a local line through the residual e.
    pub torque: f64,
}

impl Sample {
    /// Measured minus simulated.
    pub fn residual(&self) -> f64 {
        self.measured - self.predicted
    }

    /// What the simulated motion is in a variable, a current without its sign; not a number where a sample alone does not know it.
    pub fn of(&self, variable: Variable) -> f64 {
        match variable {
            Variable::Input => self.input,
            Variable::Speed => self.omega,
            Variable::Acceleration => self.acceleration,
            Variable::Current => self.current.abs(),
            Variable::Position => self.position,
            Variable::Time => self.time,
            _ => f64::NAN,
        }
    }
}

/// All compared samples of the given parts, run after run.
pub fn samples(set: &Scored, parts: &[Part]) -> Vec<Sample> {
    let (hypothesis, plant) = (&set.hypothesis, set.plant());
    let mut all = Vec::new();
    hypothesis.simulated(&set.fit.x, &plant, |index, traces, predicted| {
        of_run(&mut all, index, &hypothesis.dataset.runs[index], &plant, traces, predicted);
    });
    all.retain(|sample| parts.contains(&sample.part));
    all
}

/// Samples of every part that is compared, with the time since the last reversal of each; of a long log about so many of all rows.
pub fn seen(whole: Option<&FullPass>, set: &Scored) -> (Vec<Sample>, Vec<f64>) {
    const ALL: [Part; 3] = [Part::A, Part::B, Part::HoldOut];
    let Some(whole) = whole else {
        let samples = samples(set, &ALL);
        let since = since_reversal(&samples);
        return (samples, since);
    };
    let (plant, most) = (set.plant(), (ENOUGH / whole.count()).max(1));
    let thinned = whole.each(false, |index, run, simulation| {
        let (traces, predicted) = simulation.speed(run, &plant, run.start_speed, FINE);
        let mut all = Vec::with_capacity(predicted.len());
        of_run(&mut all, index, run, &plant, traces, predicted);
        let since = since_reversal(&all);
        let compared = all.into_iter().zip(since).filter(|seen| ALL.contains(&seen.0.part));
        let compared: Vec<(Sample, f64)> = compared.collect();
        let every = compared.len().div_ceil(most).max(1);
        compared.into_iter().step_by(every).collect::<Vec<_>>()
    });
    thinned.into_iter().flatten().unzip()
}

/// Samples of a long log that plots and places are made of. For display, chosen by judgement.
const ENOUGH: usize = 24_000;

/// Time since the simulated speed last changed its sign, s.
fn since_reversal(samples: &[Sample]) -> Vec<f64> {
    let mut last = samples.first().map_or(0.0, |s| s.time);
    let mut made = Vec::with_capacity(samples.len());
    for (k, sample) in samples.iter().enumerate() {
        let turned = k > 0 && (samples[k - 1].run != sample.run || samples[k - 1].omega * sample.omega < 0.0);
        if turned {
            last = sample.time;
        }
        made.push(sample.time - last);
    }
    made
}

/// Adds the samples of a run.
fn of_run(all: &mut Vec<Sample>, index: usize, run: &GridRun, plant: &Physics, seen: &Traces, told: &[f64]) {
    let first = all.len();
    for (k, told) in told.iter().enumerate() {
        let block = run.speed.block[k] as usize;
        let h = run.time[block + 1] - run.time[block];
        all.push(Sample {
            run: index,
            time: run.speed.time[k] - run.time[0] + run.since_s,
            measured: run.speed.measured[k],
            predicted: *told,
            weight: run.speed.weight[k],
            input: run.input[run.first_row[block] as usize],
            omega: seen.omega[block],
            acceleration: (seen.omega[block + 1] - seen.omega[block]) / h,
            current: seen.current[block + 1],
            position: if run.position.is_empty() { seen.integral[block] } else { run.position[block] },
            open: run.bridge[block] == Bridge::Open,
            part: run.speed.part[k],
            torque: 0.0,
        });
    }
    missing_torque(&mut all[first..], plant, &run.speed.from);
}

/// J·ė + D·e from a line through the residual of the speed over about a tenth of the time constant. `from`: where the compared
/// ways begin, if the residual is one of the position; its slope is that of the speed.
fn missing_torque(samples: &mut [Sample], plant: &Physics, from: &[u32]) {
    if samples.len() < 8 {
        return;
    }
    let spacing = (samples[samples.len() - 1].time - samples[0].time) / (samples.len() - 1) as f64;
    // A twentieth of a time constant bends the speed little; slopes of 25 samples are smooth enough. Judgement; not studied.
    let reach = ((0.05 * plant.time_constant_s() / spacing) as usize).clamp(2, 25);
    let mut residuals: Vec<f64> = samples.iter().map(Sample::residual).collect();
    if !from.is_empty() {
        residuals = slopes(samples, &residuals, reach, from);
    }
    for k in 0..samples.len() {
        let (first, last) = (k.saturating_sub(reach), (k + reach + 1).min(samples.len()));
        let (level, slope) = line(&samples[first..last], &residuals[first..last], samples[k].time);
        let damping = if samples[k].open { plant.viscous } else { plant.total_damping() };
        samples[k].torque = plant.inertia * slope + damping * level;
    }
}

/// Slopes of the values, never across the start of a window.
fn slopes(samples: &[Sample], values: &[f64], reach: usize, from: &[u32]) -> Vec<f64> {
    let slope = |k: usize| {
        let same = |other: usize| from[other] == from[k];
        let first = (k.saturating_sub(reach)..=k).find(|other| same(*other)).unwrap_or(k);
        let last = (k..(k + reach + 1).min(samples.len())).rev().find(|other| same(*other)).unwrap_or(k);
        line(&samples[first..=last], &values[first..=last], samples[k].time).1
    };
    (0..samples.len()).map(slope).collect()
}

/// Value at `at` and slope of the least-squares line.
fn line(samples: &[Sample], values: &[f64], at: f64) -> (f64, f64) {
    let n = values.len() as f64;
    let (mean_t, mean_v) = (samples.iter().map(|s| s.time).sum::<f64>() / n, values.iter().sum::<f64>() / n);
    let (mut tt, mut tv) = (0.0, 0.0);
    for (sample, value) in samples.iter().zip(values) {
        tt += (sample.time - mean_t) * (sample.time - mean_t);
        tv += (sample.time - mean_t) * (value - mean_v);
    }
    let slope = tv / tt.max(1e-300);
    (mean_v + slope * (at - mean_t), slope)
}
