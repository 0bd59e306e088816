//! A sensor that stands still while the motor is driven both ways: an encoder that has come off, or a logger that repeats itself.
//!
//! A shaft may stand under a small voltage, at an end stop or under a load, but then not against both directions at voltages that move it
//! elsewhere; and no shaft goes on behind a standstill with a leap that is longer than any of its steps.

use crate::system::log::{Dynamic, Run, median};
use std::ops::Range;

/// Readings that are equal to the last digit for so many rows are looked at. Chosen by judgement, tried with the
/// others of `examine`.
const LONG: usize = 20;
/// Under an input that varies by less than this part of what usually moves the shaft a speed settles, and leaps when
/// the input does. Chosen by judgement, tried with the others of `examine`.
const VARIES: f64 = 0.2;
/// A shaft stands from so many equal rows on. Chosen by judgement, tried with the others of `examine`.
const SHORT: usize = 4;
/// Rows of a stretch that must drive harder than usual, in each direction. Chosen by judgement, tried with the others
/// of `examine`.
const DRIVEN: usize = 15;
/// A leap is so many times the longest step of the record. Chosen by judgement, tried with the others of `examine`.
const LEAP: f64 = 2.0;
/// Share of a log that must be left, or nothing is cut out. Chosen by judgement, tried with the others of `examine`.
const LEFT: f64 = 0.3;
/// Runs that are shorter say nothing. Chosen by judgement, tried with the others of `examine`.
const SHORTEST: usize = 20;

/// The record without such stretches, and what is said of them.
pub fn without(record: &Dynamic) -> Option<(Dynamic, String)> {
    let usual = usual(record)?;
    let cuts: Vec<Vec<Range<usize>>> = record.runs.iter().map(|run| stretches(run, usual)).collect();
    let rows: usize = cuts.iter().flatten().map(Range::len).sum();
    if rows == 0 || rows as f64 > (1.0 - LEFT) * record.rows() as f64 {
        return None;
    }
    let (mut runs, mut told) = (Vec::new(), Vec::new());
    for (run, cuts) in record.runs.iter().zip(cuts) {
        let mut start = 0;
        for cut in cuts {
            runs.extend((start + SHORTEST <= cut.start).then(|| run.rows_between(start, cut.start, run.id)));
            told.push(format!("from {:.3} s to {:.3} s", run.t_s[cut.start], run.t_s[cut.end - 1]));
            start = cut.end;
        }
        runs.extend((start + SHORTEST <= run.rows()).then(|| run.rows_between(start, run.rows(), run.id)));
    }
    let column = super::suspects::speed_column(record);
    let note = format!(
        "{}: {column} repeats the same value {} although {} drives both ways: the encoder has stopped there, or the drive was off. These {rows} rows \
         are left out",
        record.source,
        told.join(", "),
        record.input.column()
    );
    (!runs.is_empty()).then(|| (Dynamic { runs, ..record.clone() }, note))
}

/// The input that usually moves the shaft: half of the rows in which it moves have less.
fn usual(record: &Dynamic) -> Option<f64> {
    let moves = |run: &Run| -> Option<Vec<f64>> {
        let values = reading(run)?;
        let moving = (1..run.rows()).filter(|row| values[*row] != values[row - 1]);
        Some(moving.map(|row| run.input[row].abs()).collect())
    };
    let mut moving: Vec<f64> = record.runs.iter().filter_map(moves).flatten().collect();
    (moving.len() >= LONG).then(|| median(&mut moving)).filter(|usual| *usual > 0.0)
}

fn reading(run: &Run) -> Option<&[f64]> {
    run.speed.as_deref().or(run.position.as_deref())
}

/// Rows of equal readings that no shaft makes.
fn stretches(run: &Run, usual: f64) -> Vec<Range<usize>> {
    let Some(values) = reading(run) else { return Vec::new() };
    let rows: Vec<usize> = (0..run.rows()).collect();
    let equal = rows.chunk_by(|a, b| values[*a] == values[*b]).filter(|rows| rows.len() >= LONG);
    let equal: Vec<Range<usize>> = equal.map(|rows| rows[0]..rows[rows.len() - 1] + 1).collect();
    let step = |row: usize| (values[row] - values[row - 1]).abs();
    let ends = |row: &usize| equal.iter().any(|it| it.start == *row || it.end == *row);
    let longest = (1..run.rows()).filter(|row| !ends(row)).map(step).fold(0.0, f64::max);
    // What did not move the shaft at another time does not tell that the sensor has stopped.
    let short = rows.chunk_by(|a, b| values[*a] == values[*b]).filter(|it| (SHORT..LONG).contains(&it.len()));
    let standing = short.flatten().filter(|row| values[**row] == 0.0 && run.speed.is_some());
    let stood = standing.map(|row| run.input[*row].abs()).fold(usual, f64::max);
    let frozen = |it: &Range<usize>| {
        let moves = if values[it.start] == 0.0 { stood } else { usual };
        let hard = |sign: f64| run.input[it.clone()].iter().filter(|u| sign * **u > moves).count() >= DRIVEN;
        let leap = |row: usize| (1..run.rows()).contains(&row) && step(row) > LEAP * longest;
        // A shaft that breaks away leaps in speed, and stands before.
        let stands = run.speed.is_some() && values[it.start] == 0.0;
        let leaps = leap(it.end) && (!stands || leap(it.start) && (hard(1.0) || hard(-1.0)));
        let inputs = &run.input[it.start..it.end - DRIVEN];
        let (low, high) = inputs.iter().fold((f64::MAX, f64::MIN), |(a, b), u| (u.min(a), u.max(b)));
        leaps && high - low > VARIES * usual || hard(1.0) && hard(-1.0)
    };
    equal.iter().filter(|it| frozen(it)).cloned().collect()
}
