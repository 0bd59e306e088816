//! What the simulated motion does in each block, and what a small torque there would do to each compared sample.
//!
//! The response is that of the linear part, along the motion as it is simulated: a torque φ(t) moves the speed by y with
//! J·ẏ + D·y = φ. That is exact for a rigid linear motor and close enough to rank what the remainder depends on; the table that is
//! added to the model is fitted in free run afterwards.

use crate::gap::dataset::{Part, Traces};
use crate::gap::fit::hypothesis::Hypothesis;
use crate::gap::fit::scored::Scored;
use crate::system::plant::physics::{Drive, Physics};
use crate::system::plant::unnamed::{Acting, Moment, Reversal, Term, Variable};
use nalgebra::DMatrix;
use servo::axis::Bridge;

/// The motion of one run.
struct Track {
    run: usize,
    /// In the middle of each block.
    moments: Vec<Moment>,
    /// At the grid's points: for what is read there.
    points: Vec<Moment>,
    /// What is left of a change of speed at the end of each block.
    keep: Vec<f64>,
    /// Speed per torque over each block; 0 where the shaft sticks.
    gain: Vec<f64>,
}

/// The motion of all runs.
pub struct Tracks {
    tracks: Vec<Track>,
    per_input: f64,
    sensor_scale: f64,
}

/// One compared sample, without what it depends on.
#[derive(Clone, Copy, Debug)]
pub struct Compared {
    /// Index of the run.
    pub run: usize,
    /// Index of the record: 0 the log.
    pub log: usize,
    /// What it serves for.
    pub part: Part,
    /// Measured minus simulated, over its standard deviation.
    pub residual: f64,
    /// One over the standard deviation.
    pub weight: f64,
}

impl Tracks {
    /// Follows a set over all runs. `standstill`: speed below which no direction is certain.
    pub fn of(set: &Scored, standstill: f64) -> (Self, Vec<Compared>) {
        let (hypothesis, plant) = (&set.hypothesis, set.plant());
        let (mut tracks, mut compared) = (Vec::new(), Vec::new());
        hypothesis.simulated(&set.fit.x, &plant, |index, traces, predicted| {
            tracks.push(track(hypothesis, &plant, index, traces, standstill));
            let run = &hypothesis.dataset.runs[index];
            compared.extend(predicted.iter().enumerate().map(|(k, predicted)| {
                let weight = run.speed.weight[k];
                let residual = (run.speed.measured[k] - predicted) * weight;
                Compared { run: index, log: run.log, part: run.speed.part[k], residual, weight }
            }));
        });
        (Self { tracks, per_input: plant.torque_per_input(), sensor_scale: plant.sensor_scale }, compared)
    }

    /// The values of a variable in all blocks in which the shaft is free to move.
    pub fn values(&self, variable: Variable, standstill: f64) -> Vec<f64> {
        let free = |track: &Track| -> Vec<f64> {
            let blocks = track.moments.iter().zip(&track.gain).filter(|(_, gain)| **gain > 0.0);
            blocks.map(|(moment, _)| moment.of(variable, standstill)).collect()
        };
        let values: Vec<f64> = self.tracks.iter().flat_map(free).collect();
        if values.is_empty() { vec![0.0] } else { values }
    }

    /// The moment of each compared sample.
    pub fn moments<'t>(&'t self, hypothesis: &'t Hypothesis) -> impl Iterator<Item = &'t Moment> {
        let of = |track: &'t Track| {
            let blocks = &hypothesis.dataset.runs[track.run].speed.block;
            blocks.iter().map(|block| &track.moments[*block as usize])
        };
        self.tracks.iter().flat_map(of)
    }

    /// What one unit of each value of a table would do to each compared sample, in its standard deviations.
    pub fn responses(&self, hypothesis: &Hypothesis, term: &Term, samples: usize) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(samples, term.values.len());
        let mut first = 0;
        for track in &self.tracks {
            let run = &hypothesis.dataset.runs[track.run];
            let mut predicted = Vec::new();
            let all = match term.acts {
                Acting::Reading => self.misread(track, &run.time, term),
                _ => self.moved(track, &run.time, term),
            };
            for (k, (reading, integral)) in all.into_iter().enumerate() {
                predicted.resize(run.speed.len(), 0.0);
                run.speed.predict(0.0, &run.time, &reading, &integral, &mut predicted);
                for (row, (value, weight)) in predicted.iter().zip(&run.speed.weight).enumerate() {
                    matrix[(first + row, k)] = value * weight;
                }
            }
            first += run.speed.len();
        }
        matrix
    }

    /// Reading and its integral at the grid's points for each value of a table.
    fn moved(&self, track: &Track, time: &[f64], term: &Term) -> Vec<(Vec<f64>, Vec<f64>)> {
        let size = term.values.len();
        let mut all = vec![(vec![0.0; time.len()], vec![0.0; time.len()]); size];
        let unit = if term.acts == Acting::Input { self.per_input } else { 1.0 };
        let mut acting = vec![0.0; size];
        for (block, moment) in track.moments.iter().enumerate() {
            acting.fill(0.0);
            term.weights(moment, |k, share| acting[k] += share);
            let h = time[block + 1] - time[block];
            for ((reading, integral), share) in all.iter_mut().zip(&acting) {
                reading[block + 1] =
                    track.keep[block] * reading[block] + track.gain[block] * self.sensor_scale * unit * share;
                integral[block + 1] = integral[block] + 0.5 * h * (reading[block] + reading[block + 1]);
            }
        }
        all
    }

    /// The same of a table that distorts the reading.
    fn misread(&self, track: &Track, time: &[f64], term: &Term) -> Vec<(Vec<f64>, Vec<f64>)> {
        let mut all = vec![(vec![0.0; time.len()], vec![0.0; time.len()]); term.values.len()];
        for (point, moment) in track.points.iter().enumerate() {
            term.weights(moment, |k, share| all[k].0[point] += self.sensor_scale * moment.omega * share);
        }
        for (block, moment) in track.moments.iter().enumerate() {
            let way = self.sensor_scale * moment.omega * (time[block + 1] - time[block]);
            all.iter_mut().for_each(|(_, integral)| integral[block + 1] = integral[block]);
            term.weights(moment, |k, share| all[k].1[block + 1] += way * share);
        }
        all
    }
}

fn track(hypothesis: &Hypothesis, plant: &Physics, index: usize, traces: &Traces, standstill: f64) -> Track {
    let run = &hypothesis.dataset.runs[index];
    let mut reversal = Reversal::default();
    let mut theta = run.shaft(plant, 0);
    let mut made =
        Track { run: index, moments: Vec::new(), points: Vec::new(), keep: Vec::new(), gain: Vec::new() };
    let per_input = plant.torque_per_input();
    for k in 0..run.blocks() {
        let (from, to) = (run.time[k] - run.time[0], run.time[k + 1] - run.time[0]);
        let (h, before, after) = (to - from, traces.omega[k], traces.omega[k + 1]);
        let open = run.bridge[k] == Bridge::Open;
        let (travel, since_s) = reversal.since(from, theta);
        made.moments.push(Moment {
            time_s: 0.5 * (from + to),
            theta: 0.5 * (run.shaft(plant, k) + run.shaft(plant, k + 1)),
            omega: 0.5 * (before + after),
            acceleration: (after - before) / h,
            current: if open { 0.0 } else { (traces.charge[k + 1] - traces.charge[k]) / h },
            input: if open { 0.0 } else { traces.applied[k] },
            gear_ratio: plant.gear_ratio,
            travel,
            since_s,
        });
        let moment = made.moments[k];
        made.moments[k].acceleration -= pushed(plant, &moment, per_input) / plant.inertia;
        made.points.push(Moment { theta: run.shaft(plant, k), omega: before, ..moment });
        theta += 0.5 * h * (before + after);
        reversal.follow(to, theta, after, standstill);
        let sticks = before.abs().max(after.abs()) < 1e-3 * standstill;
        let damping =
            if open || plant.drive == Drive::Torque { plant.viscous } else { plant.total_damping() };
        let keep = (-h * damping / plant.inertia).exp();
        made.keep.push(if sticks { 0.0 } else { keep });
        let gain =
            if damping * h > 1e-9 * plant.inertia { (1.0 - keep) / damping } else { h / plant.inertia };
        made.gain.push(if sticks { 0.0 } else { gain });
    }
    let last = run.blocks();
    let end = made.moments.last().copied().unwrap_or_default();
    made.points.push(Moment { theta: run.shaft(plant, last), omega: traces.omega[last], ..end });
    made
}

/// The torque of the plant's own terms: what depends on the acceleration depends on the one without them.
fn pushed(plant: &Physics, moment: &Moment, per_input: f64) -> f64 {
    let unit = |acts: Acting| match acts {
        Acting::Torque => 1.0,
        Acting::Input => per_input,
        Acting::Reading => 0.0,
    };
    plant.unnamed.iter().map(|term| unit(term.acts) * term.at(moment)).sum()
}
