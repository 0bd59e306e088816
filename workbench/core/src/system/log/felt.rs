//! Cells that only the motion shows: a speed that neither follows from the row before nor leads to the one behind, an input that was not
//! felt, a current that belongs to neither voltage nor speed.

use super::Run;
use super::steps::{Steps, VISIBLE, looked_at, quantile};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// An answer, or a reading that is off, is seen if it is so many deviations of what a row leaves. Chosen by
/// judgement; not studied.
const SEEN: f64 = 6.0;
/// What is left of it once the cell is put right, as a share. Chosen by judgement; not studied.
const LEFT: f64 = 0.3;
/// What is so many deviations away is no measure of them. Chosen by judgement; not studied.
const STRANGE: f64 = 4.0;
/// Fewer rows tell no line. Chosen by judgement; not studied.
const FEWEST: usize = 40;
/// Where the input changes a reading is off by this part of the column's range: what friction and dead zones make of
/// a change is less. Chosen by judgement; not studied.
const ANSWERING: f64 = 0.4;
/// A column's range is at least so many steps of its sensor: one step is no stray. Chosen by judgement; not studied.
const STEPS: f64 = 12.0;
/// An input that changes by less than this part of itself is held. Chosen by judgement; not studied.
const STEADY: f64 = 0.05;
/// Rows so many times as far apart as usual are not judged. Chosen by judgement; not studied.
const APART: f64 = 1.5;

/// What acts in a row: the input, the speed, friction, a dead zone, a load. Origin: their count.
const FORCES: usize = 5;

/// A line over what acts in a row.
struct Line {
    weights: DVector<f64>,
    sigma: f64,
}

impl Line {
    /// The line through most of the rows.
    fn through(rows: &[(f64, f64, f64)]) -> Option<Self> {
        let first = Self::of(rows)?;
        let near = |row: &&(f64, f64, f64)| (row.2 - first.at(row.0, row.1)).abs() < STRANGE * first.sigma;
        Self::of(&rows.iter().filter(near).copied().collect::<Vec<_>>())
    }

    /// Rows of input, speed and what follows.
    fn of(rows: &[(f64, f64, f64)]) -> Option<Self> {
        let matrix = DMatrix::from_fn(rows.len(), FORCES, |k, force| forces(rows[k].0, rows[k].1)[force]);
        let wanted = DVector::from_fn(rows.len(), |k, _| rows[k].2);
        let normal = matrix.tr_mul(&matrix) + DMatrix::identity(FORCES, FORCES) * 1e-9;
        let weights = normal.cholesky().filter(|_| rows.len() >= FEWEST)?.solve(&matrix.tr_mul(&wanted));
        let left = (&wanted - &matrix * &weights).abs();
        let most = |share| quantile(left.as_slice().to_vec(), share);
        let sigma = (1.4826 * most(0.5)?).max(0.25 * most(0.98)?);
        Some(Self { weights, sigma })
    }

    fn at(&self, input: f64, speed: f64) -> f64 {
        forces(input, speed).into_iter().zip(&self.weights).map(|(force, weight)| force * weight).sum()
    }
}

fn forces(input: f64, speed: f64) -> [f64; FORCES] {
    [input, speed, speed.signum(), input.signum(), 1.0]
}

/// How the speed answers the input from row to row.
pub struct Felt {
    speed: Vec<f64>,
    next: Line,
    /// The usual time between rows.
    step_s: f64,
}

impl Felt {
    /// From a run without its strays.
    pub fn of(run: &Run) -> Option<Self> {
        let mut speed = run.speeds()?;
        speed.resize(run.rows(), *speed.last()?);
        let finite = |row: &usize| (speed[*row] + speed[row + 1] + run.input[*row]).is_finite();
        let rows = looked_at(0, run.rows() - 1).filter(finite);
        let rows: Vec<_> = rows.map(|row| (run.input[row], speed[row], speed[row + 1])).collect();
        Some(Self { next: Line::through(&rows)?, speed, step_s: run.sample_s() })
    }

    /// What the next speed has beyond what this input makes of this speed.
    fn beyond(&self, row: usize, input: f64, speed: f64) -> f64 {
        self.speed[row + 1] - self.next.at(input, speed)
    }

    /// Has the speed answered these inputs, or those around them? `None` if neither would be seen.
    pub fn denies(&self, run: &Run, rows: &Range<usize>) -> Option<bool> {
        if rows.end + 1 >= run.rows() {
            return None;
        }
        let as_logged =
            rows.clone().map(|row| self.beyond(row, run.input[row], self.speed[row])).sum::<f64>().abs();
        let with =
            |input: f64| rows.clone().map(|row| self.beyond(row, input, self.speed[row])).sum::<f64>().abs();
        let before = rows.start.checked_sub(1).unwrap_or(rows.end);
        let as_around = with(run.input[before]).min(with(run.input[rows.end]));
        let seen = (as_logged - as_around).abs() > SEEN * self.next.sigma;
        seen.then_some(as_around < 0.5 * as_logged)
    }

    /// Rows with ones as far apart as usual on either side.
    fn inner(&self, run: &Run) -> impl Iterator<Item = usize> {
        let even = |row: usize| (0.0..APART * self.step_s).contains(&(run.t_s[row] - run.t_s[row - 1]));
        (1..run.rows().saturating_sub(1)).filter(move |row| even(*row) && even(row + 1))
    }

    /// Speeds that stand alone: with another one the motion goes on from the row before to the row behind.
    pub fn lone_speeds(&self, run: &Run, span: f64) -> Vec<usize> {
        let steps = self.speed.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let span = span.max(STEPS * steps.filter(|step| *step > 1e-9 * span).fold(f64::INFINITY, f64::min));
        let alone = |row: &usize| {
            let (input, logged) = (run.input[*row], self.speed[*row]);
            let off = self.beyond(row - 1, run.input[row - 1], self.speed[row - 1]);
            let behind = |speed: f64| self.beyond(*row, input, speed);
            let slope = self.next.weights[1];
            let between = (off - slope * behind(logged)) / (1.0 + slope * slope);
            let left = |by: f64| (off - by).hypot(behind(logged - by));
            let before = off.hypot(behind(logged));
            [off, between]
                .into_iter()
                .any(|by| by.abs() > (VISIBLE * span).max(SEEN * self.next.sigma) && left(by) < LEFT * before)
        };
        self.inner(run).filter(|row| stands_out(&self.speed, &run.input, *row, span) && alone(row)).collect()
    }

    /// Inputs far from both neighbours that the speed has not answered.
    pub fn lone_inputs(&self, run: &Run, span: f64) -> Vec<usize> {
        let alone = |row: &usize| {
            let [before, logged, behind] = [row - 1, *row, row + 1].map(|row| run.input[row]);
            let off = |input: f64| self.beyond(*row, input, self.speed[*row]).abs();
            let around = off(before).min(off(behind));
            off(logged) - around > SEEN * self.next.sigma && around < LEFT * off(logged)
        };
        self.inner(run).filter(|row| juts_out(&run.input, *row, VISIBLE * span) && alone(row)).collect()
    }

    /// Currents that belong neither to the voltage nor to the speed of their row.
    pub fn lone_currents(&self, run: &Run, changes: &[bool], span: f64) -> Vec<usize> {
        let Some(current) = &run.current_a else { return Vec::new() };
        let rows = (0..run.rows()).map(|row| (run.input[row], self.speed[row], current[row]));
        let finite = |row: &(f64, f64, f64)| (row.0 + row.1 + row.2).is_finite();
        let Some(line) = Line::through(&rows.clone().filter(finite).collect::<Vec<_>>()) else {
            return Vec::new();
        };
        let off: Vec<f64> = rows.map(|row| row.2 - line.at(row.0, row.1)).collect();
        let Some(steps) = Steps::of(&off, changes) else { return Vec::new() };
        let alone = |row: &usize| {
            let beside = off[row - 1].abs().max(off[row + 1].abs());
            let far = steps.far_over(row - 1..=row + 1).max(VISIBLE * span).max(SEEN * line.sigma);
            off[*row].abs() > far && beside < LEFT * off[*row].abs()
        };
        self.inner(run).filter(|row| stands_out(current, &run.input, *row, span) && alone(row)).collect()
    }
}

/// Lies so far outside of both neighbours: what lies between them may pass.
fn juts_out(values: &[f64], row: usize, far: f64) -> bool {
    let [before, behind] = [row - 1, row + 1].map(|other| values[row] - values[other]);
    before * behind > 0.0 && before.abs().min(behind.abs()) > far
}

/// A reading that falls to rest where the input changes is no stray: friction and dead zones do that, and no line does.
pub fn stands_out(values: &[f64], input: &[f64], row: usize, span: f64) -> bool {
    let [before, own, behind] = [row - 1, row, row + 1].map(|row| values[row].abs());
    let around = &input[row.saturating_sub(2)..=row + 1];
    let held = around.windows(2).all(|pair| (pair[1] - pair[0]).abs() < STEADY * pair[1].abs());
    juts_out(values, row, span * if held { VISIBLE } else { ANSWERING }) && (held || own > before.max(behind))
}
