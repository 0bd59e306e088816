//! Is the time of a record in seconds? A logger's milliseconds under `t_s` make every row a settled speed, or every row a
//! thousand steps of simulation.
//!
//! Rows further apart than the model's time constant are looked at: as settled speeds they follow the input of their own row
//! or of the one before; read in milliseconds they follow the model's response to the input. The better reading is right.
//! A record whose `[log] sample_hz` agrees with its time column is believed.

use crate::gap::residual::best_sum;
use crate::gap::tables;
use crate::system::log::{Columns, Dynamic, Run};
use crate::system::model::Model;
use crate::text::input_error::InputError;

/// What a logger may have written instead of seconds.
const BASES: [(&str, f64); 2] = [("ms", 1e-3), ("µs", 1e-6)];
/// Rows closer than this, s, and closer than the model's time constant, are in seconds. Chosen by judgement; not
/// studied.
const CLOSE_S: f64 = 0.5;
/// Rows that are looked at. A budget of computing time, chosen by judgement.
const ROWS: usize = 20_000;
/// Pieces of the line that settled speeds make over the input. Chosen by judgement; not studied.
const BENDS: usize = 10;
/// Time constants between rows beyond which several runs can neither be simulated nor read as a table. Chosen by
/// judgement; not studied.
const USELESS: f64 = 50.0;
/// The error of the other reading, relative to that in seconds and to the speed's variation, below which it is right.
/// Origin: 14 measured rigs; none of their 28 logs is accused, and with their time in milliseconds 12 are.
const BETTER: f64 = 0.5;
/// A declared rate agrees within this factor. Chosen by judgement; not studied.
const SAME_RATE: f64 = 3.0;
/// Share of the largest speed below which the axis stands. Chosen by judgement; not studied.
const STANDS: f64 = 0.05;

/// Refuses a record whose time is plainly not in seconds; says what it looks like and how to map it.
pub fn check(model: &Model, log: &Dynamic, columns: &Columns) -> Result<(), InputError> {
    let Some(run) = log.runs.iter().max_by_key(|run| run.rows()) else { return Ok(()) };
    let (apart_s, slow_s) = (run.sample_s(), tables::time_constant_s(model));
    if apart_s < CLOSE_S && apart_s < slow_s {
        return Ok(());
    }
    let declared = model.sample_hz.map(|hz| hz * apart_s);
    let agrees = |ratio: f64| (1.0 / SAME_RATE..=SAME_RATE).contains(&ratio);
    if declared.is_some_and(agrees) {
        return Ok(());
    }
    // Rows that show neither dynamics nor one settled curve are of no use in seconds.
    let useless = apart_s > USELESS * slow_s && tables::settled(model, log).is_none();
    let looks = |(_, factor): &&(&str, f64)| {
        declared.is_some_and(|ratio| agrees(ratio * factor)) || follows(log, slow_s, *factor)
    };
    let fallback = BASES.first().filter(|_| useless);
    let Some((unit, factor)) = BASES.iter().find(looks).or(fallback) else { return Ok(()) };
    let (name, so_far) = columns.time();
    let what = format!(
        "its rows are {apart_s:.3} s apart, but the model's time constant is {slow_s:.3} s, as if the \
         time were in {unit}: map it with --columns \"t_s={name}*{}\"; if it is in seconds, say so in the model, \
         [log] sample_hz = {:.4}",
        so_far * factor,
        1.0 / apart_s
    );
    Err(InputError::file(&log.source, what))
}

/// Read with `factor`, do the rows follow the model's response better than they follow the input as settled speeds?
fn follows(log: &Dynamic, slow_s: f64, factor: f64) -> bool {
    let most = ROWS / log.runs.len();
    let pieces: Vec<Piece> = log.runs.iter().filter_map(|run| Piece::of(run, most)).collect();
    if pieces.iter().all(Piece::unchanged) {
        return false;
    }
    let all = |part: &dyn Fn(&Piece) -> Vec<f64>| pieces.iter().flat_map(part).collect::<Vec<f64>>();
    let response = |of: fn(f64) -> f64, factor, slow_s| all(&|piece| piece.response(of, factor, slow_s));
    let before = |piece: &Piece| [&piece.input[..1], &piece.input[..piece.input.len() - 1]].concat();
    let rows = [all(&|piece| piece.input.to_vec()), all(&before)];
    let mut settled: Vec<Vec<f64>> = rows.iter().flat_map(|input| bends(input)).collect();
    // Time constants of a third and of three times the one found span what a wrong clock leaves open. Judgement; not studied.
    settled.extend([1.0, 3.0].map(|times| response(|u| u, 1.0, times * slow_s)));
    let shapes: [fn(f64) -> f64; 3] = [|u| u, |u| u * u.abs(), |u| u.signum() * f64::from(u != 0.0)];
    let mut moving = Vec::from(shapes.map(|shape| response(shape, factor, slow_s)));
    moving.extend([0.3, 3.0].map(|times| response(|u| u, factor, times * slow_s)));
    let speed = all(&|piece| piece.speed.clone());
    let other = unexplained(&moving, &speed);
    other < BETTER && other < BETTER * unexplained(&settled, &speed)
}

/// The beginning of a run.
struct Piece<'a> {
    time: &'a [f64],
    input: &'a [f64],
    /// The speed, or the change of the position, in whatever time the file counts.
    speed: Vec<f64>,
}

impl<'a> Piece<'a> {
    fn of(run: &'a Run, most: usize) -> Option<Self> {
        let mut speed = run.speeds()?;
        speed.truncate(most);
        let rows = speed.len();
        (rows > 0).then(|| Self { time: &run.t_s[..rows], input: &run.input[..rows], speed })
    }

    fn starts_at_rest(&self) -> bool {
        let fastest = self.speed.iter().fold(0.0_f64, |most, w| most.max(w.abs()));
        self.speed[0].abs() < STANDS * fastest
    }

    /// Nothing that a response could follow.
    fn unchanged(&self) -> bool {
        !self.starts_at_rest() && self.input.iter().all(|u| *u == self.input[0])
    }

    /// The first-order response to the held input, reshaped; of an axis without damping the integral.
    fn response(&self, shape: fn(f64) -> f64, factor: f64, slow_s: f64) -> Vec<f64> {
        let mut state = if self.starts_at_rest() { 0.0 } else { shape(self.input[0]) };
        let mut response = vec![state];
        for (t, u) in self.time.windows(2).zip(self.input) {
            let (step, u) = (factor * (t[1] - t[0]), shape(*u));
            let settles = slow_s.is_finite();
            state = if settles { u + (state - u) * (-step / slow_s).exp() } else { state + u * step };
            response.push(state);
        }
        response
    }
}

/// What a broken line through the range of the input is the sum of, and a step at 0.
fn bends(input: &[f64]) -> Vec<Vec<f64>> {
    let mut sorted = input.to_vec();
    sorted.sort_by(f64::total_cmp);
    let corner = |k: usize| sorted[k * (sorted.len() - 1) / BENDS];
    let beyond = |from: f64| input.iter().map(|u| (u - from).max(0.0)).collect();
    let step = input.iter().map(|u| f64::from(*u > 0.0)).collect();
    (0..BENDS).map(|k| beyond(corner(k))).chain([step]).collect()
}

/// Rms of what the best sum of `parts` and a constant leaves of `speed`, relative to the speed's variation.
fn unexplained(parts: &[Vec<f64>], speed: &[f64]) -> f64 {
    best_sum(parts, speed).map_or(1.0, |(_, left)| left)
}
