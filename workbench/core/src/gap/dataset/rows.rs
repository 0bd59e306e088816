//! Rows as they were logged, brought into runs that a simulation can follow.

use crate::system::log::Run;
use std::ops::Range;

/// A gap of so many samples, and of a part of the time constant, starts a new run. Chosen by judgement; not studied.
const GAP_SAMPLES: f64 = 20.0;

/// Cuts a run where samples were dropped for long: what happened there is unknown.
pub(super) fn unbroken(run: &Run, time_constant: f64, notes: &mut Vec<String>) -> Vec<Run> {
    let pieces = unbroken_rows(run, time_constant, notes).into_iter();
    pieces.map(|rows| run.rows_between(rows.start, rows.end, run.id)).collect()
}

/// The rows of the pieces of such a run.
pub(super) fn unbroken_rows(run: &Run, time_constant: f64, notes: &mut Vec<String>) -> Vec<Range<usize>> {
    let longest = (GAP_SAMPLES * run.sample_s()).max(time_constant);
    let mut cuts = vec![0];
    cuts.extend((1..run.rows()).filter(|row| run.t_s[*row] - run.t_s[*row - 1] > longest));
    cuts.push(run.rows());
    let pieces: Vec<Range<usize>> =
        cuts.windows(2).filter(|cut| cut[1] - cut[0] >= 8).map(|cut| cut[0]..cut[1]).collect();
    if cuts.len() > 2 {
        let (id, gaps, count) = (run.id, cuts.len() - 2, pieces.len());
        notes.push(format!("run {id}: {gaps} gaps in time; it is analysed in {count} pieces"));
    }
    pieces
}

/// Time stamps that a file rounded go back on their even grid; a real jitter stays as it is.
pub(super) fn even_rows(mut run: Run) -> Run {
    let last = run.rows() - 1;
    let (start, step) = (run.t_s[0], (run.t_s[last] - run.t_s[0]) / last as f64);
    let even = |k: usize| start + k as f64 * step;
    let rounding = (0..=last).map(|k| (run.t_s[k] - even(k)).abs()).fold(0.0, f64::max);
    // A hundredth of a row is the rounding of a printed time. Chosen by judgement; not studied.
    if rounding < 0.01 * step {
        (0..=last).for_each(|k| run.t_s[k] = even(k));
    }
    run
}
