//! Several topics in one file, each at its own rate: a row holds one of them, and the other cells are empty.

use super::Run;
use super::bridging::{fill, measured};

/// Share of the rows with an empty cell from which on the signals have their own rates. Chosen by judgement; not
/// studied.
const OWN: f64 = 0.3;

/// Rows of one time that hold different signals become one, the later one. The rows that are empty then.
pub fn merge(run: &mut Run, same: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    let mut merged = Vec::new();
    let Run { t_s, input, position, speed, current_a, supply_v, .. } = run;
    let mut columns: Vec<&mut Vec<f64>> =
        [position, speed, current_a, supply_v].into_iter().flatten().chain([input]).collect();
    for row in (1..t_s.len()).filter(|row| same(row - 1, *row)) {
        let apart = |column: &&mut Vec<f64>| !(column[row - 1] - column[row]).is_finite();
        if t_s[row] == t_s[row - 1] && columns.iter().all(apart) {
            for column in columns.iter_mut().filter(|column| column[row].is_nan()) {
                column[row] = std::mem::replace(&mut column[row - 1], f64::NAN);
            }
            t_s[row - 1] = f64::NAN;
            merged.push(row - 1);
        }
    }
    merged
}

/// Makes a record at the rows of its output, where the signals have their own rates: the input, which holds until its next
/// value, is averaged from row to row; what else is measured is interpolated. The rows that stay, and a sentence.
pub fn joined(run: &mut Run, same: impl Fn(usize, usize) -> bool) -> Option<(Vec<usize>, String)> {
    let output = run.speed.as_ref().or(run.position.as_ref())?;
    let empty = |row: &usize| run.input[*row].is_nan() || output[*row].is_nan();
    if (0..run.rows()).filter(empty).count() as f64 <= OWN * run.rows() as f64 {
        return None;
    }
    let count = |values: &[f64]| values.iter().filter(|value| value.is_finite()).count();
    let note = format!(
        "The signals have their own rates ({} values of the input, {} of the output): the rows are those of the output, and the \
         input is its mean from row to row.",
        count(&run.input),
        count(output)
    );
    let rows: Vec<usize> =
        (0..run.rows()).filter(|row| output[*row].is_finite() && run.t_s[*row].is_finite()).collect();
    run.input = held(run, &rows, &same);
    let (t_s, measured) = measured(run);
    for column in measured {
        let there: Vec<usize> = (0..column.len()).filter(|row| column[*row].is_finite()).collect();
        there.windows(2).for_each(|pair| fill(t_s, column, pair[0], pair[1]));
    }
    Some((rows, note))
}

/// The mean of the held input from each of these rows to the next one.
fn held(run: &Run, rows: &[usize], same: &impl Fn(usize, usize) -> bool) -> Vec<f64> {
    let (mut means, mut level, mut next) = (vec![f64::NAN; run.rows()], f64::NAN, 0);
    for (k, &row) in rows.iter().enumerate() {
        let until = rows.get(k + 1).copied().filter(|until| same(row, *until));
        let (mut area, mut from) = (0.0, run.t_s[row]);
        while next < until.unwrap_or(row + 1) {
            let (value, at) = (run.input[next], run.t_s[next].max(run.t_s[row]));
            if value.is_finite() {
                area += if at > from { level * (at - from) } else { 0.0 };
                (level, from) = (value, at);
            }
            next += 1;
        }
        means[row] = match until.map(|until| run.t_s[until]) {
            Some(end) if from > run.t_s[row] => (area + level * (end - from)) / (end - run.t_s[row]),
            _ => level,
        };
    }
    means
}
