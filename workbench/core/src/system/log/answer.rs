//! The time of a record, and how its output answers its input.

use super::{Dynamic, Run};
use serde::Serialize;
use std::borrow::Cow;

/// A step beyond this many usual ones is a gap. Chosen by judgement; not studied.
const GAP: f64 = 1.5;
/// Lag from which on it is looked for, rows: below 1 the output is first. Chosen by judgement; not studied.
const FIRST_LAG: i64 = -3;
/// Share of the peak at which the answer begins: a first-order answer jumps to its peak and fades from there, and
/// noise moves a flat peak, not its edge. Chosen by judgement; not studied.
const ONSET: f64 = 0.5;
/// Rows between the values whose changes are compared. Chosen by judgement; not studied.
const STRIDES: [usize; 3] = [1, 4, 16];
/// A correlation that is no chance however few the rows are. Chosen by judgement; not studied.
const PLAIN: f64 = 0.6;
/// Correlation of an input's change with the next one beyond which the input is smooth. Chosen by judgement; not
/// studied.
const SMOOTH: f64 = 0.3;
/// Rows over which an answer of the output is looked for. Chosen by judgement; not studied.
const LONGEST_LAG: usize = 200;
/// Standard deviations of chance that a correlation has to exceed. Chosen by judgement; not studied.
const CHANCE: f64 = 6.0;

/// The time of a record.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Time {
    /// Continuous records.
    pub records: usize,
    /// All of them together, s.
    pub seconds: f64,
    /// Rows a second: from the median step.
    pub rate_hz: f64,
    /// Half the central 90 % of the steps, relative to the median.
    pub jitter: f64,
    /// Steps beyond 1.5 times the median.
    pub gaps: usize,
    /// The longest step, s.
    pub longest_s: f64,
}

/// Where changes of the input and of the speed are most alike.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Answer {
    /// Rows from a change of the input to the beginning of the speed's. 1: at once, 0 or less: the speed is first.
    pub rows: i64,
    /// Time beyond the next row, s.
    pub delay_s: f64,
    /// The largest correlation of the changes; negative: the speed falls when the input rises.
    pub correlation: f64,
    /// The input changes smoothly: the lag of the motor is in `rows` and `delay_s`.
    pub smooth: bool,
    /// Rows until the correlation has fallen to 1/e: about the slowest time constant.
    pub fades_rows: Option<usize>,
}

/// The smallest difference between two values; differences that are rounding are none.
pub fn smallest_step(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    values.sort_unstable_by(f64::total_cmp);
    let rounding = 1e-9 * values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let steps = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > rounding);
    steps.min_by(f64::total_cmp)
}

impl Time {
    pub(super) fn of(record: &Dynamic) -> Self {
        let steps = |run: &Run| run.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>();
        let mut steps: Vec<f64> = record.runs.iter().flat_map(steps).collect();
        steps.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| steps[(share * (steps.len() - 1) as f64).round() as usize];
        let usual = at(0.5);
        Self {
            records: record.runs.len(),
            seconds: record.runs.iter().map(|run| run.t_s[run.rows() - 1] - run.t_s[0]).sum(),
            rate_hz: 1.0 / usual,
            jitter: 0.5 * (at(0.95) - at(0.05)) / usual,
            gaps: steps.iter().filter(|step| **step > GAP * usual).count(),
            longest_s: at(1.0),
        }
    }
}

/// The speed, or the change of the position a second.
pub fn speed(run: &Run) -> Option<Cow<'_, [f64]>> {
    let from = |position: &Vec<f64>| {
        let rows = position.windows(2).zip(run.t_s.windows(2));
        let mut speed: Vec<f64> = rows.map(|(x, t)| (x[1] - x[0]) / (t[1] - t[0])).collect();
        speed.insert(0, speed[0]);
        speed
    };
    let logged = run.speed.as_ref().map(Cow::from);
    logged.or_else(|| run.position.as_ref().map(|position| from(position).into()))
}

/// Changes from each value to the one `stride` rows later.
fn changes(values: &[f64], stride: usize) -> Vec<f64> {
    let later = values.iter().skip(stride).step_by(stride);
    values.iter().step_by(stride).zip(later).map(|(before, after)| after - before).collect()
}

/// Correlates the changes of the input with those of the speed: from row to row, and if noise hides that, over more rows.
pub(super) fn answer(record: &Dynamic) -> Option<Answer> {
    let usual = record.runs.iter().max_by_key(|run| run.rows())?.sample_s();
    STRIDES.into_iter().find_map(|stride| {
        let piece = |run: &Run| Some([changes(&run.input, stride), changes(&speed(run)?, stride)]);
        let seen = Changes(record.runs.iter().filter_map(piece).collect()).answer()?;
        // Within several rows the beginning is not known better.
        let rows = if stride == 1 { seen.rows } else { (seen.rows - 1).max(0) * stride as i64 + 1 };
        let delay_s = (rows - 1).max(0) as f64 * usual;
        Some(Answer { rows, delay_s, fades_rows: seen.fades_rows.map(|rows| rows * stride), ..seen })
    })
}

/// Changes of input and speed, a pair a run.
struct Changes(Vec<[Vec<f64>; 2]>);

impl Changes {
    /// Sum over all runs of one column times another, `lag` rows later.
    fn product(&self, first: usize, second: usize, lag: i64) -> f64 {
        let of_one = |piece: &[Vec<f64>; 2]| -> f64 {
            let first = piece[first].iter().skip((-lag).max(0) as usize);
            first.zip(piece[second].iter().skip(lag.max(0) as usize)).map(|(a, b)| a * b).sum()
        };
        self.0.iter().map(of_one).sum()
    }

    fn answer(&self) -> Option<Answer> {
        let rows: usize = self.0.iter().map(|piece| piece[0].len()).sum();
        let norm = (self.product(0, 0, 0) * self.product(1, 1, 0)).sqrt();
        if norm == 0.0 {
            return None;
        }
        let longest = LONGEST_LAG.min(rows / 4) as i64;
        let seen: Vec<f64> = (FIRST_LAG..=longest).map(|lag| self.product(0, 1, lag) / norm).collect();
        let at = (0..seen.len()).max_by(|a, b| seen[*a].abs().total_cmp(&seen[*b].abs()))?;
        let peak = seen[at];
        if peak.abs() < (CHANCE / (rows as f64).sqrt()).min(PLAIN) {
            return None;
        }
        // A smooth input spreads the peak to both sides.
        let smooth = self.product(0, 0, 1) > SMOOTH * self.product(0, 0, 0);
        let onset = if smooth { at } else { seen.iter().position(|value| value / peak > ONSET)? };
        let faded = |three: &[f64]| three.iter().sum::<f64>() / (3.0 * peak) < (-1.0_f64).exp();
        let fades_rows = if smooth { None } else { seen[onset..].windows(3).position(faded) };
        Some(Answer { rows: FIRST_LAG + onset as i64, delay_s: 0.0, correlation: peak, smooth, fades_rows })
    }
}
