//! Whether a run was in motion when its record began.

use super::{GridRun, Simulation};
use crate::gap::dataset::COARSE;
use crate::system::plant::physics::Physics;

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
    // The intercept of a line through a dozen points is as uncertain as one of them, and a fifth more. A hundredth of full speed is rest.
    // Chosen by judgement; not studied.
    let (first, uncertain) = (run.speed.measured[0], 1.2 * sigma);
    let moves = first * start > 0.0 && first.abs().min(start.abs()) > 4.0 * uncertain;
    if moves && sy.abs() / n > 0.01 * full_speed && predicts_better(run, plant, start) {
        run.start_speed = start;
        run.start_sigma = 2.0 * uncertain;
    }
}

/// True if the plant is nearer to the first time constant of a run from this speed than from rest.
fn predicts_better(run: &GridRun, plant: &Physics, start: f64) -> bool {
    let end = run.time[0] + plant.time_constant_s();
    let samples = run.speed.time.partition_point(|time| *time < end).max(6);
    let mut simulation = Simulation::default();
    let mut error = |speed: f64| {
        let (_, predicted) = simulation.speed(run, plant, speed, COARSE);
        let pairs = run.speed.measured.iter().zip(predicted).take(samples);
        pairs.map(|(y, p)| (y - p) * (y - p)).sum::<f64>()
    };
    error(start) < error(0.0)
}
