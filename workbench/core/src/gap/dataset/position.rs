//! A position that is compared itself, where the log has no speed.
//!
//! A coarse encoder at a slow rate, differenced to a speed, is mostly steps: 1° at 14 ms has a floor of 0.62 rad/s. The way from a
//! place that was measured to where the shaft is later loses nothing of what was measured.

use super::noise::hf_noise;
use super::probe::{Grid, Probes};
use super::run::travel;
use super::{GridRun, Scales};
use crate::system::log::median;
use crate::system::model::Encoder;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// A position is compared itself if its difference would have more noise than this part of full speed. Where it has
/// less, the difference is the better measure: the way of a pendulum drifts with every error of its weight, and names
/// were then given to the drift. Origin: 22 measured rigs keep their answers at 0.02; at 0.01 a log of a slow sine
/// was compared by its position, and a symmetric friction came out with two sides.
pub(super) const COARSE: f64 = 0.02;
/// Windows are at least so long, s, and at least so many time constants: a run is cut only where its drift would be
/// judged. Chosen by judgement; not studied.
pub(super) const LONGEST_S: f64 = 0.5;
pub(super) const LONGEST_TIMES: f64 = 10.0;
/// A parabola is no motion: the speed at its end is wrong by up to such a part. Chosen by judgement; not studied.
const CURVED: f64 = 0.05;
/// Points of the grid from which a place and its speed are estimated, on one side. Chosen by judgement; not studied.
const REACH: usize = 5;

/// The ways of the shaft from the start of each window.
pub(super) fn ways(run: &GridRun, window_s: f64) -> Probes {
    let (grid, mut probes) = (Grid(&run.time), Probes::default());
    let duration = run.time[run.blocks()] - run.time[0];
    let count = (duration / window_s).round().max(1.0);
    let window = |point: usize| ((run.time[point] - run.time[0]) / duration * count) as usize;
    let (mut from, mut place) = (0, local(run, 0).0);
    for to in 1..=run.blocks() {
        probes.push_way(&grid, from, to, run.position[to] - place);
        if window(to) > window(from) {
            (from, place) = (to, local(run, to).0);
        }
    }
    probes
}

/// Place and speed at a point of the grid, from a parabola through the positions around it.
fn local(run: &GridRun, point: usize) -> (f64, f64) {
    let (first, last) = (point.saturating_sub(REACH), (point + REACH).min(run.position.len() - 1));
    let rows = last - first + 1;
    if rows < 4 {
        return (run.position[point], 0.0);
    }
    let time = |k: usize| run.time[first + k] - run.time[point];
    let length = (time(rows - 1) - time(0)).max(1e-12);
    let powers = DMatrix::from_fn(rows, 3, |k, power| (time(k) / length).powi(power as i32));
    let places = DVector::from_fn(rows, |k, _| run.position[first + k]);
    match powers.svd(true, true).solve(&places, 1e-12) {
        Ok(found) => (found[0], found[1] / length),
        Err(_) => (run.position[point], 0.0),
    }
}

/// Standard deviation of a measured position: what its third differences show, and not below the encoder's steps, as they are declared
/// or as they are seen.
pub(super) fn noise(runs: &[GridRun], encoder: Option<Encoder>) -> f64 {
    let mut each: Vec<f64> = runs.iter().map(|run| hf_noise(&run.position, 0)).collect();
    // No sensor resolves its travel better than 1 in 100,000 (17 bits). Chosen by judgement; not studied.
    let declared = encoder.map_or(0.0, |encoder| TAU / encoder.counts_per_rev);
    let step = declared.max(seen_step(runs.iter().map(|run| &run.position[..])));
    median(&mut each).max(step / 12f64.sqrt()).max(1e-5 * travel(runs))
}

/// The smallest step between neighbours, or one that is common: of a quantised position all steps are multiples of it.
pub(super) fn seen_step<'a>(positions: impl Iterator<Item = &'a [f64]>) -> f64 {
    let steps = positions.flat_map(|it| it.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
    let mut steps: Vec<f64> = steps.filter(|step| *step > 1e-9).collect();
    steps.sort_unstable_by(f64::total_cmp);
    // Of steps of any size a tenth lies so near to a multiple.
    let is_step = |small: &f64| {
        let multiple = |step: &&f64| ((**step / small).round() * small - **step).abs() < 0.05 * small;
        steps.iter().filter(multiple).count() as f64 > 0.9 * steps.len() as f64
    };
    let small = steps.iter().take(1).chain(steps.get(steps.len() / 20));
    small.copied().find(is_step).unwrap_or(0.0)
}

/// Speeds at the middle of each sample of a run, from the measured positions.
pub fn speeds(run: &GridRun) -> Vec<f64> {
    let speed = |block: &u32| {
        let (before, after) = ((*block as usize).saturating_sub(1), (*block as usize + 1).min(run.blocks()));
        (run.position[after] - run.position[before]) / (run.time[after] - run.time[before])
    };
    run.speed.block.iter().map(speed).collect()
}

/// Speed at the start of a run, and how uncertain it is, from the first positions.
pub(super) fn start_from_position(run: &mut GridRun, sigma: f64, scales: &Scales) {
    let (_, speed) = local(run, 0);
    let reach = REACH.min(run.blocks());
    let length = (run.time[reach] - run.time[0]).max(1e-9);
    // Slope at the end of a parabola through n points over a length: about √192 / (√n · length) times the noise of one.
    let uncertain = sigma * (192.0 / (reach as f64 + 1.0)).sqrt() / length;
    // Less than a hundredth of the speeds in the log is rest. Chosen by judgement; not studied.
    if speed.abs() > 3.0 * uncertain && speed.abs() > 0.01 * scales.speed {
        run.start_speed = speed;
        run.start_sigma = uncertain.max(CURVED * speed.abs());
    }
}
