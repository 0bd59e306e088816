//! Whether a run was in motion when its record began.

use super::{GridRun, Simulation};
use crate::gap::fit::COARSE;
use crate::system::plant::physics::Physics;

/// A first sample is taken for the start if it leaves less than this part of what the line through the first ones leaves: beyond what the
/// noise of one sample does.
const CLEARLY: f64 = 0.5;

/// Speed at the start from a line through the first samples. A run moves at its start only if its first sample does, and
/// if the plant predicts the first time constant better with that speed than from rest.
pub(super) fn start_speed(run: &mut GridRun, plant: &Physics, sigma: f64, full_speed: f64) {
    let samples = run.speed.len().min(6);
    if samples < 3 {
        return;
    }
    let t = |k: usize| run.speed.time[k] - run.time[0];
    let (mut n, mut st, mut sy, mut stt, mut sty) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for k in 0..samples {
        let y = run.speed.measured[k];
        (n, st, sy, stt, sty) = (n + 1.0, st + t(k), sy + y, stt + t(k) * t(k), sty + t(k) * y);
    }
    let slope = (n * sty - st * sy) / (n * stt - st * st).max(1e-300);
    let start = (sy - slope * st) / n;
    let (first, uncertain) = (run.speed.measured[0], 1.2 * sigma);
    let moves = first * start > 0.0 && first.abs().min(start.abs()) > 4.0 * uncertain;
    if !moves || sy.abs() / n <= 0.01 * full_speed {
        return;
    }
    let from = |speed: f64| error_from(run, plant, speed);
    if from(start) < from(0.0) {
        // The line misses a start in the middle of a jump, the first sample has more noise.
        run.start_speed = if from(first) < CLEARLY * from(start) { first } else { start };
        run.start_sigma = 2.0 * uncertain;
    }
}

/// The squared error of the plant over the first time constant of a run, from a speed on.
fn error_from(run: &GridRun, plant: &Physics, speed: f64) -> f64 {
    let end = run.time[0] + plant.time_constant_s();
    let samples = run.speed.time.partition_point(|time| *time < end).max(6);
    let mut simulation = Simulation::default();
    let (_, predicted) = simulation.speed(run, plant, speed, COARSE);
    let pairs = run.speed.measured.iter().zip(predicted).take(samples);
    pairs.map(|(y, p)| (y - p) * (y - p)).sum()
}
