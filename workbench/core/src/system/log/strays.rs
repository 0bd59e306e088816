//! Cells that no motion and no driver makes: a reading that jumps away and comes back within some rows, a voltage that the motor never
//! felt.
//!
//! How far a column jumps from row to row, and how far it does where the input changes, is what it is measured by: what moves fast is
//! not accused of it. An input may jump as it likes. It is asked whether the speed has answered.

use super::Run;
use super::bridging::MOST;
use super::cells::Place;
use super::felt::{Felt, stands_out};
use super::steps::Steps;
use std::ops::Range;

/// A longer excursion is motion. Chosen by judgement; not studied.
const LONGEST: usize = 8;
/// Rows before the first and behind the last that may be bad together. Chosen by judgement; not studied.
const EDGE: usize = 5;
/// An input that steps by this part of its range is answered. Chosen by judgement; not studied.
const CHANGE: f64 = 0.25;
/// It comes back to where it began within this part of its height. Chosen by judgement; not studied.
const BACK: f64 = 0.35;
/// At the edge of a record it comes from nowhere: there it is so many times the longest step inside. The first step
/// from rest is longer than those that follow by e^(row/time constant). Chosen by judgement; not studied.
const EDGE_STEPS: f64 = 3.0;
/// A gap between values that is so many times all that lies on one side of it. Chosen by judgement; not studied.
const GAP: f64 = 2.0;
/// More pulses of the input than this, and than this share of the rows, were meant. Chosen by judgement; not studied.
const MEANT: (usize, f64) = (12, 2e-3);
/// An input is beyond the supply, or beyond all others, from this factor on. Chosen by judgement; not studied.
const BEYOND: (f64, f64) = (1.1, 1.5);
/// A supply may leave its value by this part of it for some rows, and may be read right. Chosen by judgement; not
/// studied.
const SAG: f64 = 0.15;
/// Records with fewer rows tell no ordinary step. Chosen by judgement; not studied.
const FEWEST: usize = 60;

/// Lines that are told one by one. Chosen by judgement; not studied.
const TOLD: usize = 12;

/// Stretches of rows.
type Ranges = Vec<Range<usize>>;

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

/// Everything that cannot be in a run, column by column; the input last.
pub fn found(run: &Run, input: &'static str, linear: bool, supply_v: Option<f64>) -> Vec<Strays> {
    if run.rows() < FEWEST {
        return Vec::new();
    }
    let still = vec![false; run.rows()];
    let drive = Steps::of(&run.input, &still);
    let changes = changes(run, drive.as_ref().map_or(0.0, |drive| CHANGE * drive.span));
    let (place, speed) = if linear { ("q_m", "v_m_s") } else { ("theta_rad", "omega_rad_s") };
    // A record may start at rest, and with the current of a stall.
    let columns =
        [(place, 0.0, GAP), (speed, 1.0, GAP), ("i_a", f64::INFINITY, 10.0 * GAP), ("vbus_v", 0.0, GAP)];
    let (mut all, mut clean) = (Vec::new(), run.clone());
    for (column, start, gap) in columns {
        let Some(values) = clean.readings(column) else { continue };
        let Some(steps) = Steps::of(values, &changes) else { continue };
        let (mut bad, outside) = in_column(values, &steps, [gap, start, EDGE_STEPS]);
        let inner = |rows: &Range<usize>| rows.len() == 1 && rows.start > 0 && rows.end < run.rows();
        // A current is at rest at once.
        if column == "i_a" {
            bad.retain(|rows| !inner(rows) || stands_out(values, &run.input, rows.start, steps.span));
        }
        if column == "vbus_v" {
            bad.retain(|rows| beyond_sag(values, rows));
        }
        blank(values, &bad);
        all.push((column, bad, outside, steps.span));
    }
    let Some(drive) = drive else { return strays(all) };
    let (mut bad, outside) = in_column(&run.input, &drive, [GAP, 0.0, 0.0]);
    blank(&mut clean.input, &bad);
    let felt = Felt::of(&clean);
    bad = never_felt(run, bad, felt.as_ref(), supply_v);
    if let Some(felt) = &felt {
        let lone = few(felt.lone_inputs(run, drive.span), run);
        blank(&mut clean.input, &lone);
        add(&mut bad, lone);
        for (column, bad, _, span) in &mut all {
            let lone = match *column {
                "omega_rad_s" | "v_m_s" => felt.lone_speeds(&clean, *span),
                "i_a" => felt.lone_currents(&clean, &changes, *span),
                _ => continue,
            };
            add(bad, few(lone, run));
        }
    }
    all.push((input, bad, outside, drive.span));
    strays(all)
}

/// Rows in which the input steps by more than `far`.
fn changes(run: &Run, far: f64) -> Vec<bool> {
    (0..run.rows()).map(|row| row > 0 && (run.input[row] - run.input[row - 1]).abs() > far).collect()
}

/// True if a supply leaves its value by more than what a step draws makes it give way.
fn beyond_sag(values: &[f64], rows: &Range<usize>) -> bool {
    let beside = values.get(rows.start.wrapping_sub(1)).or(values.get(rows.end));
    beside.is_none_or(|usual| values[rows.clone()].iter().any(|value| (value / usual - 1.0).abs() > SAG))
}

fn strays(columns: Vec<(&'static str, Ranges, usize, f64)>) -> Vec<Strays> {
    let found = columns.into_iter().map(|(column, rows, outside, _)| {
        let found = Strays { column, rows, outside: false };
        Strays { outside: 2 * outside > found.count(), ..found }
    });
    found.filter(|found| !found.rows.is_empty()).collect()
}

fn blank(values: &mut [f64], rows: &[Range<usize>]) {
    rows.iter().for_each(|rows| values[rows.clone()].fill(f64::NAN));
}

/// Rows of their own, unless so many were meant.
fn few(rows: Vec<usize>, run: &Run) -> Ranges {
    let few = rows.len() <= most_meant(run);
    rows.into_iter().filter(|_| few).map(|row| row..row + 1).collect()
}

fn most_meant(run: &Run) -> usize {
    ((MEANT.1 * run.rows() as f64) as usize).max(MEANT.0)
}

/// Those that are not among them yet.
fn add(rows: &mut Ranges, mut more: Ranges) {
    more.retain(|it| !rows.iter().any(|known| known.contains(&it.start)));
    rows.append(&mut more);
    rows.sort_unstable_by_key(|rows| rows.start);
}

/// Of the inputs that stand out those that the motor has not answered. Where an answer would not be seen: those beyond the supply, and few
/// short ones.
fn never_felt(run: &Run, mut rows: Ranges, felt: Option<&Felt>, supply_v: Option<f64>) -> Ranges {
    let few = rows.len() <= most_meant(run);
    let mut others: Vec<f64> = run.input.iter().map(|value| value.abs()).collect();
    rows.iter().for_each(|stray| others[stray.clone()].fill(0.0));
    let most = others.into_iter().fold(0.0, f64::max);
    let limit = supply_v.map_or(BEYOND.1 * most, |supply| BEYOND.0 * supply.max(most));
    let beyond = |stray: &Range<usize>| run.input[stray.clone()].iter().any(|value| value.abs() > limit);
    let wrong = |stray: &Range<usize>| {
        let inside = stray.start >= EDGE && stray.end + EDGE <= run.rows();
        let denied = felt.and_then(|felt| felt.denies(run, stray));
        // The first row of a run may still hold the command before it.
        let begins = stray.start == 0 || run.t_s[stray.start] < run.t_s[stray.start - 1];
        let unlike = denied.unwrap_or(beyond(stray) || few && inside) && !begins;
        beyond(stray) && (supply_v.is_some() || denied.is_none_or(|denied| denied)) || unlike
    };
    rows.retain(wrong);
    // So many were meant, and the motor is faster than the rows.
    if rows.iter().map(Range::len).sum::<usize>() as f64 > MOST * run.rows() as f64 {
        rows.retain(beyond);
    }
    rows
}

/// Rows of a column that stand out, and how many of them lie outside of all others. At the edge of a record a jump must be so many times as
/// far as the longest of the other steps, and at its start come from more than this part of the largest value.
fn in_column(values: &[f64], steps: &Steps, [gap, start, times]: [f64; 3]) -> (Ranges, usize) {
    let rows = |which: &dyn Fn(usize) -> bool| (0..values.len()).filter(|k| which(*k)).collect::<Vec<_>>();
    if rows(&|row| values[row].is_finite()).len() < FEWEST {
        return (Vec::new(), 0);
    }
    let mut bad = outside(values, gap);
    let count = bad.iter().filter(|bad| **bad).count();
    let good = |bad: &[bool]| rows(&|row| !bad[row] && values[row].is_finite());
    excursions(values, &good(&bad), steps).into_iter().for_each(|row| bad[row] = true);
    edges(values, &good(&bad), steps.far, start, times).into_iter().for_each(|row| bad[row] = true);
    let ranges = rows(&|row| bad[row]);
    let ranges = ranges.chunk_by(|a, b| a + 1 == *b).map(|rows| rows[0]..rows[rows.len() - 1] + 1);
    (ranges.collect(), count)
}

/// Values beyond a gap that is wider than twice all that the others hold. A motion passes through every value on its way.
fn outside(values: &[f64], gap: f64) -> Vec<bool> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let spare = (sorted.len() / 50).max(EDGE);
    let (mut low, mut high) = (sorted[spare], sorted[sorted.len() - 1 - spare]);
    for value in &sorted[sorted.len() - spare..] {
        high = if value - high > gap * (high - low) { high } else { *value };
    }
    for value in sorted[..spare].iter().rev() {
        low = if low - value > gap * (high - low) { low } else { *value };
    }
    let apart = high > low;
    values.iter().map(|value| apart && (*value > high || *value < low)).collect()
}

/// What jumps away and comes back, among these rows.
fn excursions(values: &[f64], rows: &[usize], steps: &Steps) -> Vec<usize> {
    let mut bad = Vec::new();
    let (mut last, mut from) = (0, 1);
    while from < rows.len() {
        match excursion(&|k| values[rows[k]], rows, steps, last..from) {
            Some(end) => {
                bad.extend(&rows[from..end]);
                from = end;
            }
            None => (last, from) = (from, from + 1),
        }
    }
    bad
}

/// The end of an excursion behind the last good row.
fn excursion(at: &dyn Fn(usize) -> f64, rows: &[usize], steps: &Steps, gap: Range<usize>) -> Option<usize> {
    let (before, from) = (at(gap.start), gap.end);
    let far = |end: usize| steps.far_over(rows[gap.start]..=rows[end]);
    let away = |end: &usize| (at(end - 1) - before).abs() > far(*end);
    let ends = (from + 1..(from + 1 + LONGEST).min(rows.len())).take_while(away);
    let ends: Vec<usize> = ends.filter(|end| (at(*end) - at(end - 1)).abs() > far(*end)).collect();
    let returns = |end: &&usize| {
        let height = (from..**end).map(|k| (at(k) - before).abs()).fold(0.0, f64::max);
        let drift = steps.ordinary * (*end - from + 1) as f64;
        (at(**end) - before).abs() <= BACK * height + drift
    };
    // Where the column steps meanwhile, it comes back to neither side: then it must stand out from both.
    let side = (at(from) - before).signum();
    let stands_out = |end: &&usize| {
        (from..**end).all(|k| side * (at(k) - before) > far(**end) && side * (at(k) - at(**end)) > far(**end))
    };
    ends.iter().find(returns).or_else(|| ends.iter().find(stands_out)).copied()
}

/// The first and the last rows, where they stand apart from all behind and before them.
fn edges(values: &[f64], rows: &[usize], far: f64, start: f64, times: f64) -> Vec<usize> {
    let count = rows.len();
    let step = |k: usize| (values[rows[k]] - values[rows[k - 1]]).abs();
    let longest = (EDGE + 1..count.saturating_sub(EDGE)).map(step).fold(0.0, f64::max);
    let leaps = |k: &usize| step(*k) > far.max(times * longest);
    let largest = rows[EDGE..].iter().fold(0.0_f64, |most, row| most.max(values[*row].abs()));
    let moves = |k: &usize| rows[..*k].iter().any(|row| values[*row].abs() > start * largest);
    let first = (1..=EDGE).rev().find(leaps).filter(moves).unwrap_or(0);
    let last = (count - EDGE..count).find(leaps).unwrap_or(count);
    rows[..first].iter().chain(&rows[last..]).copied().collect()
}

impl Run {
    /// What was measured, by our name of the column.
    fn readings(&mut self, column: &str) -> Option<&mut Vec<f64>> {
        match column {
            "i_a" => self.current_a.as_mut(),
            "vbus_v" => self.supply_v.as_mut(),
            "theta_rad" | "q_m" => self.position.as_mut(),
            "omega_rad_s" | "v_m_s" => self.speed.as_mut(),
            _ => None,
        }
    }

    /// Takes out what cannot be, and says where it stood: a reading becomes a hole, an input is that of the rows around it where those
    /// agree, and otherwise its row is lost.
    pub(super) fn take_out(
        &mut self,
        found: &[Strays],
        lost: &mut [bool],
        place: impl Fn(usize) -> Place,
    ) -> Option<String> {
        let mut told: Vec<(usize, String)> = Vec::new();
        for strays in found {
            for rows in &strays.rows {
                let values = self.readings(strays.column);
                let held = values.as_ref().map(|values| values[rows.start]);
                let held = held.unwrap_or_else(|| self.input[rows.start]);
                told.push((rows.start, said(rows, &place, strays.column, held)));
                match self.readings(strays.column) {
                    Some(values) => values[rows.clone()].fill(f64::NAN),
                    None => bridge(&mut self.input, rows, lost),
                }
            }
        }
        told.sort_by_key(|told| told.0);
        let listed: Vec<&str> = told.iter().take(TOLD).map(|told| told.1.as_str()).collect();
        let more =
            told.len().checked_sub(TOLD + 1).map_or(String::new(), |k| format!("; and {} more", k + 1));
        let what = match told.len() {
            1 => "1 reading cannot be and is".to_owned(),
            count => format!("{count} readings cannot be and are"),
        };
        (!told.is_empty()).then(|| format!("{what} left out: {}{more}.", listed.join("; ")))
    }
}

fn said(rows: &Range<usize>, place: impl Fn(usize) -> Place, column: &str, held: f64) -> String {
    let (held, from) = (super::short(held), place(rows.start));
    match rows.len() {
        1 => format!("{from}: {column} {held}"),
        _ => format!("{}s {} to {}: {column} {held} …", from.what, from.number, place(rows.end - 1).number),
    }
}

/// The input of the row before where the row behind has the same.
fn bridge(input: &mut [f64], rows: &Range<usize>, lost: &mut [bool]) {
    let before = rows.start.checked_sub(1).map(|row| input[row]);
    let around = before.zip(input.get(rows.end).copied());
    let same = |(a, b): &(f64, f64)| (a - b).abs() <= 0.2 * (a - input[rows.start]).abs();
    match around.filter(same) {
        Some((a, b)) => input[rows.clone()].fill(0.5 * (a + b)),
        None => lost[rows.clone()].fill(true),
    }
}
