//! Over how long a speed was averaged, from the steps of its readings: a difference of an encoder's counts over a time is a multiple
//! of one count over that time.

use std::f64::consts::TAU;
use truing_core::system::log::Run;

/// A reading lies on a multiple if it misses it by less than this share of a step: rounding to a digit of rpm leaves a hundredth.
const ON_STEP: f64 = 0.05;
/// Share of the readings that must lie on multiples.
const MOST: f64 = 0.98;
/// The window is a whole number of rows within this share.
const WHOLE: f64 = 0.03;
/// Readings further from 0 than so many steps say nothing: the error of the step grows with its number.
const STEPS: f64 = 50.0;
/// Readings that move, at least.
const READINGS: usize = 30;

/// The window of a run's speed, s; `None`: its steps are not those of such an encoder.
pub fn of_speed(run: &Run, counts_per_rev: f64) -> Option<f64> {
    let speed = run.speed.as_ref()?;
    let moving: Vec<f64> = speed.iter().map(|omega| omega.abs()).filter(|omega| *omega > 0.0).collect();
    let first = moving.iter().copied().fold(f64::INFINITY, f64::min);
    if moving.len() < READINGS {
        return None;
    }
    let step = refined(&moving, first);
    let near: Vec<f64> = moving.iter().map(|omega| omega / step).filter(|number| *number < STEPS).collect();
    let on = near.iter().filter(|number| (*number - number.round()).abs() < ON_STEP).count();
    let window = TAU / counts_per_rev / step;
    let rows = window / run.sample_s();
    let whole = rows.round() >= 1.0 && (rows - rows.round()).abs() < WHOLE * rows;
    (whole && near.len() >= READINGS && on as f64 >= MOST * near.len() as f64)
        .then(|| rows.round() * run.sample_s())
}

/// The step from all readings, each of which is taken as a multiple of it: the further ones sharpen it.
fn refined(moving: &[f64], first: f64) -> f64 {
    let mut step = first;
    for within in [3.0, 10.0, STEPS] {
        let near = moving.iter().filter(|omega| **omega < (within + 0.5) * step);
        let (mut products, mut squares) = (0.0, 0.0);
        for omega in near {
            let number = (omega / step).round();
            products += omega * number;
            squares += number * number;
        }
        step = products / squares;
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts of an encoder every 10 ms, differenced over some rows, as rpm with a digit.
    fn run(rows: usize, rounded: bool) -> Run {
        let counts = |k: usize| {
            (64.0 / TAU * (40.0 * (k as f64 * 0.02).sin() + 3.0 * (k as f64 * 0.07).cos())).round()
        };
        let speed = |k: usize| {
            let omega = (counts(k + rows) - counts(k)) / 64.0 * TAU / (rows as f64 * 0.01);
            let rpm = omega * 60.0 / TAU;
            if rounded {
                (rpm * 10.0).round() / 10.0 * TAU / 60.0
            } else {
                omega + 0.3 * (k as f64 * 1.7).sin()
            }
        };
        Run {
            t_s: (0..600).map(|k| k as f64 * 0.01).collect(),
            speed: Some((0..600).map(speed).collect()),
            ..Run::default()
        }
    }

    #[test]
    fn the_steps_of_a_difference_tell_its_window() {
        for rows in [1, 2, 5] {
            let window = of_speed(&run(rows, true), 64.0).unwrap();
            assert!((window - rows as f64 * 0.01).abs() < 1e-9, "{rows}: {window}");
        }
    }

    #[test]
    fn a_speed_without_such_steps_has_no_window() {
        assert_eq!(of_speed(&run(2, false), 64.0), None);
        assert_eq!(of_speed(&run(2, true), 100.0), None, "another encoder");
    }
}
