//! Driven stretches of a run, and how a first-order motion answers what acts in them.

use super::excerpt::{integrated, looked_at};
use crate::system::log::{Run, median};
use servo::axis::Bridge;
use std::ops::Range;

/// A stretch of driven rows is looked at from this length on. Chosen by judgement, tried with the others of
/// `examine`.
const SHORTEST: usize = 12;
/// Rows so many times as far apart as others are no motion that was driven as logged. Chosen by judgement, tried with
/// the others of `examine`.
const GAP: f64 = 10.0;
/// The steps of a differenced position stay below this part of the fastest motion. Chosen by judgement, tried with
/// the others of `examine`.
const COARSE: f64 = 0.05;

/// A driven stretch of a run.
#[derive(Clone)]
pub struct Stretch {
    /// Times, s.
    pub time: Vec<f64>,
    /// Inputs.
    pub input: Vec<f64>,
    /// Speeds, rad/s.
    pub speed: Vec<f64>,
    /// Places of the shaft, rad.
    pub place: Vec<f64>,
}

/// What acts: the input, friction, a constant load, gravity in two directions, a spring, and what a dead zone takes
/// from the input. Origin: their count.
pub const FORCES: usize = 7;
/// What a dead zone takes, among them.
pub const TAKEN: usize = FORCES - 1;
/// Input, friction and a constant load, the first of them. Origin: their count.
pub const PLAIN_FORCES: usize = 3;

/// What drives the motion in a row, force by force. Slower than `stands` no direction is certain.
fn drives(input: f64, speed: f64, place: f64, stands: f64) -> [f64; FORCES] {
    let direction = if speed.abs() > stands { speed.signum() } else { 0.0 };
    let taken = input.signum() * f64::from(input != 0.0);
    [input, -direction, 1.0, place.sin(), place.cos(), place, taken]
}

impl Stretch {
    /// The responses to every force, and the speed without what is left of its start, row after row.
    pub fn responses(&self, rate: f64, stands: f64, each: &mut impl FnMut([f64; FORCES], f64)) {
        let mut state = [0.0; FORCES];
        let mut start = self.speed[0];
        for row in 0..self.time.len() {
            each(state, self.speed[row] - start);
            if row + 1 < self.time.len() {
                let step = self.time[row + 1] - self.time[row];
                let decay = (-rate * step).exp();
                let gain = if rate * step > 1e-9 { (1.0 - decay) / rate } else { step };
                let drives = drives(self.input[row], self.speed[row], self.place[row], stands);
                for (state, drive) in state.iter_mut().zip(drives) {
                    *state = *state * decay + drive * gain;
                }
                start *= decay;
            }
        }
    }
}

/// The driven stretches of a run, with a speed for every row.
pub fn driven(run: &Run) -> Vec<Stretch> {
    let pieces = looked_at(run.rows());
    // Positions are differenced over the same rows everywhere.
    if pieces.len() == 1 || run.speed.is_none() {
        return driven_in(run);
    }
    let piece = |rows: &Range<usize>| driven_in(&run.rows_between(rows.start, rows.end, run.id));
    pieces.iter().flat_map(piece).collect()
}

fn driven_in(run: &Run) -> Vec<Stretch> {
    let (time, speed, stride) = match (&run.speed, &run.position) {
        (Some(speed), _) => (run.t_s.clone(), speed.clone(), 1),
        (None, Some(position)) => differenced(&run.t_s, position),
        (None, None) => return Vec::new(),
    };
    let place = run.position.clone().unwrap_or_else(|| integrated(&run.t_s, &speed));
    // A difference belongs to the middle of its rows, and what drives it until the next one does so from there.
    let (middle, shared) =
        if run.speed.is_some() { (0, 0.0) } else { (stride / 2, 0.5 * (stride % 2) as f64) };
    let mean = |k: usize| {
        let at = |row: usize| run.input[row.min(run.input.len() - 1)];
        let from = k * stride + middle;
        let inner: f64 = (from..from + stride).map(at).sum();
        (inner + shared * (at(from + stride) - at(from))) / stride as f64
    };
    let apart = GAP * stride as f64 * run.sample_s();
    let (mut found, mut from) = (Vec::new(), 0);
    for row in 0..=time.len() {
        let ends = row == time.len() || run.bridge[row * stride] != Bridge::Driven;
        let torn = !ends && row > from && time[row] - time[row - 1] > apart;
        if (ends || torn) && row - from >= SHORTEST {
            found.push(Stretch {
                time: time[from..row].to_vec(),
                input: (from..row).map(mean).collect(),
                speed: speed[from..row].to_vec(),
                place: (from..row).map(|k| place[k * stride + middle]).collect(),
            });
        }
        if ends || torn {
            from = row + usize::from(ends);
        }
    }
    found
}

/// Speeds from positions over so many rows that the steps of an encoder do not hide them, at the middle of those rows.
fn differenced(time: &[f64], position: &[f64]) -> (Vec<f64>, Vec<f64>, usize) {
    let over = |stride: usize| -> Vec<f64> {
        let rows = (0..(time.len() - 1) / stride).map(|k| (k * stride, (k + 1) * stride));
        rows.map(|(a, b)| (position[b] - position[a]) / (time[b] - time[a])).collect()
    };
    let rough = |speed: &[f64]| {
        let mut bends: Vec<f64> = speed.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
        let fastest = speed.iter().fold(0.0_f64, |most, w| most.max(w.abs()));
        median(&mut bends) / fastest.max(1e-300)
    };
    let strides = [1, 2, 4, 8, 16, 32, 64];
    let fine = strides.into_iter().find(|stride| rough(&over(*stride)) < COARSE);
    let stride = fine.unwrap_or(64).min((time.len() / SHORTEST).max(1));
    let speed = over(stride);
    let middle = |k: usize| 0.5 * (time[k * stride] + time[(k + 1) * stride]);
    ((0..speed.len()).map(middle).collect(), speed, stride)
}
