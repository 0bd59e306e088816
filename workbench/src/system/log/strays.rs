//! Cells that no motion and no driver makes: a reading that jumps away and comes back within some rows, a voltage that the motor never
//! felt.
//!
//! How far a column jumps from row to row, and how far it does where the input changes, is what it is measured by: what moves fast is
//! not accused of it. An input may jump as it likes. It is asked whether the speed has answered.

use super::Run;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// A longer excursion is motion.
const LONGEST: usize = 8;
/// Rows before the first and behind the last that may be bad together.
const EDGE: usize = 5;
/// An excursion is so many times as far as this share of a column's steps from row to row.
const FAR: f64 = 4.0;
const ORDINARY: f64 = 0.95;
/// And this part of the column's range: what is less harms nobody.
const VISIBLE: f64 = 0.12;
/// It comes back to where it began within this part of its height.
const BACK: f64 = 0.35;
/// At the edge of a record it comes from nowhere: there it is so much of the range.
const ALONE: f64 = 0.4;
/// An answer is seen if it is so many deviations of a step of the speed.
const SEEN: f64 = 6.0;
/// More pulses of the input than this, and than this share of the rows, were meant.
const MEANT: (usize, f64) = (12, 2e-3);
/// An input is beyond the supply, or beyond all others, from this factor on.
const BEYOND: (f64, f64) = (1.1, 1.5);
/// More rows do not tell better what is ordinary.
const ROWS: usize = 50_000;
/// Records with fewer rows tell no ordinary step.
const FEWEST: usize = 60;

/// Lines that are told one by one.
const TOLD: usize = 12;

/// What was found in one column.
pub struct Strays {
    /// Our name of the column.
    pub column: &'static str,
    /// Rows that cannot be.
    pub rows: Vec<Range<usize>>,
    /// True if their values lie far outside of what the column holds besides.
    pub outside: bool,
}

impl Strays {
    /// How many rows.
    pub fn count(&self) -> usize {
        self.rows.iter().map(Range::len).sum()
    }
}

/// Steps of a column.
struct Steps {
    /// An excursion goes farther.
    far: f64,
    /// And farther than this beside a change of the input.
    answering: f64,
    span: f64,
    ordinary: f64,
}

impl Steps {
    fn of(values: &[f64], changes: &[bool]) -> Option<Self> {
        let sizes = |wanted: &dyn Fn(usize) -> bool| {
            let rows = looked_at(1, values.len()).filter(|row| wanted(*row));
            let mut steps: Vec<f64> = rows.map(|row| (values[row] - values[row - 1]).abs()).collect();
            steps.retain(|step| step.is_finite());
            steps
        };
        let ordinary = quantile(sizes(&|_| true), ORDINARY)?;
        let answers = quantile(sizes(&|row| changes[row] || changes[row - 1]), ORDINARY).unwrap_or(0.0);
        let finite = || looked_at(0, values.len()).map(|row| values[row]).filter(|value| value.is_finite());
        let finite = || finite().collect::<Vec<f64>>();
        let span = quantile(finite(), 0.98)? - quantile(finite(), 0.02)?;
        let far = (FAR * ordinary).max(VISIBLE * span);
        (span > 0.0).then_some(Self { far, answering: far.max(2.5 * answers), span, ordinary })
    }
}

/// As many rows as tell what is ordinary.
fn looked_at(from: usize, to: usize) -> impl Iterator<Item = usize> {
    (from..to).step_by(to / ROWS + 1)
}

fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    let rank = ((values.len().checked_sub(1)?) as f64 * share) as usize;
    Some(*values.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// Everything that cannot be in a run, column by column; the input last.
pub fn found(run: &Run, input: &'static str, linear: bool, supply_v: Option<f64>) -> Vec<Strays> {
    if run.rows() < FEWEST {
        return Vec::new();
    }
    let still = vec![false; run.rows()];
    let drive = Steps::of(&run.input, &still);
    let far = drive.as_ref().map_or(0.0, |drive| 0.25 * drive.span);
    let changes: Vec<bool> =
        (0..run.rows()).map(|row| row > 0 && (run.input[row] - run.input[row - 1]).abs() > far).collect();
    let (place, speed) = if linear { ("q_m", "v_m_s") } else { ("theta_rad", "omega_rad_s") };
    let columns =
        [(place, &run.position), (speed, &run.speed), ("i_a", &run.current_a), ("vbus_v", &run.supply_v)];
    let mut all = Vec::new();
    for (column, values) in columns {
        let Some(values) = values else { continue };
        let Some(steps) = Steps::of(values, &changes) else { continue };
        let mut rows = excursions(values, &steps, &changes);
        rows.extend(edges(values, ALONE * steps.span.max(steps.answering / ALONE)));
        all.extend(strays(column, values, rows, &steps));
    }
    if let Some(steps) = drive {
        let mut rows = excursions(&run.input, &steps, &still);
        let inner = rows.len();
        rows.extend(edges(&run.input, steps.far));
        let felt = Felt::of(run, &rows);
        let most = (MEANT.1 * run.rows() as f64).max(MEANT.0 as f64) as usize;
        let mut bare: Vec<f64> = run.input.iter().map(|value| value.abs()).collect();
        rows.iter().for_each(|stray| bare[stray.clone()].fill(0.0));
        let others = bare.into_iter().fold(0.0, f64::max);
        let limit = supply_v.map_or(BEYOND.1 * others, |supply| (BEYOND.0 * supply).max(BEYOND.0 * others));
        let wrong = |k: &usize| {
            let beyond = run.input[rows[*k].clone()].iter().any(|value| value.abs() > limit);
            let rare = *k < inner && inner <= most;
            felt.as_ref().and_then(|felt| felt.denies(run, &rows[*k])).unwrap_or(beyond || rare)
        };
        let wrong: Vec<Range<usize>> = (0..rows.len()).filter(wrong).map(|k| rows[k].clone()).collect();
        all.extend(strays(input, &run.input, wrong, &steps));
    }
    all
}

fn strays(
    column: &'static str,
    values: &[f64],
    mut rows: Vec<Range<usize>>,
    steps: &Steps,
) -> Option<Strays> {
    rows.sort_by_key(|stray| stray.start);
    let middle = quantile(values.to_vec(), 0.5)?;
    let outside = |row: usize| (values[row] - middle).abs() > 3.0 * steps.span;
    let outside = rows.iter().flat_map(Clone::clone).filter(|row| outside(*row)).count();
    let count: usize = rows.iter().map(Range::len).sum();
    (!rows.is_empty()).then_some(Strays { column, rows, outside: 2 * outside > count })
}

/// What jumps away and comes back.
fn excursions(values: &[f64], steps: &Steps, changes: &[bool]) -> Vec<Range<usize>> {
    let mut rows = Vec::new();
    let mut row = 1;
    while row < values.len() {
        let end = excursion(values, steps, changes, row);
        rows.extend(end.map(|end| row..end));
        row = end.unwrap_or(row) + 1;
    }
    rows
}

/// The row behind an excursion that begins in this row.
fn excursion(values: &[f64], steps: &Steps, changes: &[bool], row: usize) -> Option<usize> {
    let before = values[row - 1];
    let mut height = 0.0_f64;
    for end in row + 1..(row + 1 + LONGEST).min(values.len()) {
        let near = changes[row - 1..=end].iter().any(|change| *change);
        let far = if near { steps.answering } else { steps.far };
        let away = (values[end - 1] - before).abs();
        if away.is_nan() || away <= far {
            return None;
        }
        height = height.max(away);
        let drift = steps.ordinary * (end - row + 1) as f64;
        let left = (values[end] - before).abs();
        // Where the column steps meanwhile, it comes back to neither side: then it must stand out from both.
        let side = (values[row] - before).signum();
        let beyond = |value: &f64| side * (value - before) > far && side * (value - values[end]) > far;
        let stands_out = values[row..end].iter().all(beyond);
        let back = left <= BACK * height + drift || stands_out;
        if back && (values[end] - values[end - 1]).abs() > far {
            return Some(end);
        }
    }
    None
}

/// The first and the last rows, where they stand apart from all behind and before them.
fn edges(values: &[f64], far: f64) -> Vec<Range<usize>> {
    let rows = values.len();
    let jumps = |row: usize| (values[row] - values[row - 1]).abs() > far;
    let calm = |range: Range<usize>| !range.into_iter().any(jumps);
    let first = (1..=EDGE).rev().find(|row| jumps(*row)).filter(|row| calm(row + 1..row + 2 * EDGE));
    let last = (rows - EDGE..rows).find(|row| jumps(*row)).filter(|row| calm(row - 2 * EDGE..*row));
    first.map(|row| 0..row).into_iter().chain(last.map(|row| row..rows)).collect()
}

/// How the speed answers the input from row to row.
struct Felt {
    speed: Vec<f64>,
    weights: [f64; 4],
    sigma: f64,
}

impl Felt {
    /// From all rows but these.
    fn of(run: &Run, but: &[Range<usize>]) -> Option<Self> {
        let speed = run.speed.clone().or_else(|| {
            let position = run.position.as_ref()?;
            let pairs = position.windows(2).zip(run.t_s.windows(2));
            let mut speed: Vec<f64> = pairs.map(|(x, t)| (x[1] - x[0]) / (t[1] - t[0])).collect();
            speed.push(*speed.last()?);
            Some(speed)
        })?;
        let near = |row: usize| but.iter().any(|stray| row + 2 >= stray.start && row <= stray.end + 1);
        let finite = |row: &usize| (speed[*row] + speed[*row + 1] + run.input[*row]).is_finite();
        let rows = looked_at(0, run.rows() - 1).filter(finite);
        let rows: Vec<usize> = rows.filter(|row| !near(*row)).collect();
        let matrix =
            DMatrix::from_fn(rows.len(), 4, |k, force| force_of(run.input[rows[k]], speed[rows[k]], force));
        let wanted = DVector::from_fn(rows.len(), |k, _| speed[rows[k] + 1] - speed[rows[k]]);
        let normal = matrix.tr_mul(&matrix) + DMatrix::identity(4, 4) * 1e-12;
        let weights = normal.cholesky()?.solve(&matrix.tr_mul(&wanted));
        let left = (&wanted - &matrix * &weights).abs();
        let sigma = 1.4826 * quantile(left.as_slice().to_vec(), 0.5)?;
        let sigma = sigma.max(0.25 * quantile(left.as_slice().to_vec(), 0.98)?);
        Some(Self { speed, weights: std::array::from_fn(|k| weights[k]), sigma })
    }

    /// Has the speed answered these inputs, or those around them? `None` if neither would be seen.
    fn denies(&self, run: &Run, rows: &Range<usize>) -> Option<bool> {
        if rows.end + 1 >= run.rows() {
            return None;
        }
        let around = [rows.start.checked_sub(1).unwrap_or(rows.end), rows.end];
        let missed = |input: &dyn Fn(usize) -> f64| -> f64 {
            let step = |row: usize| {
                let forces =
                    (0..4).map(|force| self.weights[force] * force_of(input(row), self.speed[row], force));
                self.speed[row + 1] - self.speed[row] - forces.sum::<f64>()
            };
            rows.clone().map(step).sum::<f64>().abs()
        };
        let as_logged = missed(&|row| run.input[row]);
        let as_around = around.map(|row| missed(&|_| run.input[row]));
        let as_around = as_around.into_iter().fold(f64::INFINITY, f64::min);
        let seen = (as_logged - as_around).abs() > SEEN * self.sigma;
        seen.then_some(as_around < 0.5 * as_logged)
    }
}

fn force_of(input: f64, speed: f64, force: usize) -> f64 {
    [input, speed, speed.signum(), 1.0][force]
}

impl Run {
    /// Takes out what cannot be, and says which lines held it: a reading becomes a hole, an input is that of the rows around it where those
    /// agree, and otherwise its row is lost.
    pub(super) fn take_out(
        &mut self,
        found: &[Strays],
        lost: &mut [bool],
        line: impl Fn(usize) -> u64,
    ) -> Option<String> {
        let mut told: Vec<(usize, String)> = Vec::new();
        for strays in found {
            for rows in &strays.rows {
                let values = match strays.column {
                    "i_a" => self.current_a.as_mut(),
                    "vbus_v" => self.supply_v.as_mut(),
                    "theta_rad" | "q_m" => self.position.as_mut(),
                    "omega_rad_s" | "v_m_s" => self.speed.as_mut(),
                    _ => None,
                };
                let held = values.as_ref().map_or(self.input[rows.start], |values| values[rows.start]);
                told.push((rows.start, said(rows, &line, strays.column, held)));
                match values {
                    Some(values) => values[rows.clone()].fill(f64::NAN),
                    None => bridge(&mut self.input, rows, lost),
                }
            }
        }
        told.sort_by_key(|told| told.0);
        let (count, more) = (told.len(), told.len().saturating_sub(TOLD));
        let listed: Vec<&str> = told.iter().take(TOLD).map(|told| told.1.as_str()).collect();
        let more = if more > 0 { format!("; and {more} more") } else { String::new() };
        let what = if count == 1 { "1 reading cannot be and is" } else { "readings cannot be and are" };
        let many = if count == 1 { String::new() } else { format!("{count} ") };
        (count > 0).then(|| format!("{many}{what} left out: {}{more}.", listed.join("; ")))
    }
}

fn said(rows: &Range<usize>, line: impl Fn(usize) -> u64, column: &str, held: f64) -> String {
    let held = super::short(held);
    match rows.len() {
        1 => format!("line {}: {column} {held}", line(rows.start)),
        _ => format!("lines {} to {}: {column} {held} …", line(rows.start), line(rows.end - 1)),
    }
}

/// The input of the row before where the row behind has the same.
fn bridge(input: &mut [f64], rows: &Range<usize>, lost: &mut [bool]) {
    let before = rows.start.checked_sub(1).map(|row| input[row]);
    match (before, input.get(rows.end).copied()) {
        (Some(before), Some(behind))
            if (before - behind).abs() <= 0.2 * (before - input[rows.start]).abs() =>
        {
            input[rows.clone()].fill(0.5 * (before + behind));
        }
        _ => lost[rows.clone()].fill(true),
    }
}
