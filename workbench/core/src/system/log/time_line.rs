//! The time of a record where it does not simply increase: a counter that wraps, stamps that repeat, one that is wrong, a
//! logger that was started anew.

use super::cells::Place;
use super::spelling::short;
use super::steps::median;

/// What a counter may count to before it begins at 0 again, in its own units: 16, 24, 31 and 32 bits.
const WRAPS: [(f64, &str); 4] =
    [(65_536.0, "2^16"), (16_777_216.0, "2^24"), (2_147_483_648.0, "2^31"), (4_294_967_296.0, "2^32")];
/// The same for clocks, s.
const CLOCKS: [(f64, &str); 2] = [(3600.0, "a full hour"), (86_400.0, "midnight")];
/// The step over a wrap, relative to the usual one, at most: a few rows may be lost there. Chosen by judgement; not
/// studied.
const NEAR: f64 = 20.0;
/// A share of rows that repeat the time of the row before, beyond which the clock is coarser than the rows. Chosen by
/// judgement; not studied.
const COARSE: f64 = 0.2;
/// More parts than this in a hundred rows are no restarts of a logger. Chosen by judgement; not studied.
const PARTS: f64 = 0.05;

/// What became of a time column.
#[derive(Default)]
pub struct Mended {
    /// Rows that are left out: all but the last of equal times, and wrong times.
    pub dropped: Vec<usize>,
    /// Rows with which the time begins anew.
    pub restarts: Vec<usize>,
    /// What was done, in sentences.
    pub notes: Vec<String>,
}

/// Makes a time increase as far as that can be known. `unit`: one of the file's units, s; `same`: a
/// row continues the run of the row before; `place`: where a row stands. An error is a sentence.
pub fn mend(
    time: &mut [f64],
    unit: f64,
    same: impl Fn(usize) -> bool,
    place: impl Fn(usize) -> Place,
) -> Result<Mended, String> {
    let mut mended = Mended::default();
    if (1..time.len()).all(|row| time[row] > time[row - 1] || !same(row)) {
        return Ok(mended);
    }
    let rows: Vec<usize> = (0..time.len()).filter(|row| time[*row].is_finite()).collect();
    if rows.len() < 2 {
        return Ok(mended);
    }
    mended.notes.extend(unwrapped(time, &rows, unit, &same, &place));
    let twice: Vec<usize> = rows
        .windows(2)
        .filter(|pair| same(pair[1]) && time[pair[1]] == time[pair[0]])
        .map(|pair| pair[0])
        .collect();
    if twice.len() as f64 > COARSE * rows.len() as f64 {
        let step = (time[rows[rows.len() - 1]] - time[rows[0]]) / (rows.len() - 1) as f64;
        return Err(format!(
            "time does not increase: {} of {} rows repeat the time of the row before, so the clock is coarser than the rows; if the \
             rows are evenly spaced, give their step with --columns \"t_s=row*{}\"",
            twice.len(),
            rows.len(),
            short(step)
        ));
    }
    mended.notes.extend(twice.first().map(|first| {
        let (count, place) = (twice.len(), place(*first));
        format!("Of rows with the same time the last one is read ({count} left out, the first in {place}).")
    }));
    let rows: Vec<usize> = rows.into_iter().filter(|row| twice.binary_search(row).is_err()).collect();
    mended.dropped = twice;
    parted(time, &rows, &same, &place, &mut mended);
    if mended.restarts.len() as f64 > PARTS * rows.len() as f64 {
        return Err(format!(
            "time does not increase in {} rows ({} is the first): is another column the time? Else number the runs in a column \
             `run`, or give the step of the rows with --columns \"t_s=row*SECONDS\"",
            mended.restarts.len(),
            place(mended.restarts[0])
        ));
    }
    mended.notes.extend(mended.restarts.first().map(|first| {
        let count = mended.restarts.len() + 1;
        format!("The time begins anew in {}: the log is read as {count} records.", place(*first))
    }));
    Ok(mended)
}

/// Adds what a counter counted to where it began at 0 again, and says so.
fn unwrapped(
    time: &mut [f64],
    rows: &[usize],
    unit: f64,
    same: &impl Fn(usize) -> bool,
    place: &impl Fn(usize) -> Place,
) -> Option<String> {
    let mut steps: Vec<f64> = rows.windows(2).map(|pair| (time[pair[1]] - time[pair[0]]).abs()).collect();
    let usual = median(&mut steps);
    let full = WRAPS.iter().map(|known| (known.0 * unit, known.1)).chain(CLOCKS);
    let (mut added, mut before, mut told) = (0.0, f64::NAN, None);
    for &row in rows {
        let raw = time[row];
        let over = |known: &(f64, &str)| (0.0..NEAR * usual).contains(&(known.0 - (before - raw)));
        if let Some((counts, name)) = full.clone().find(over).filter(|_| raw < before && same(row)) {
            added += counts;
            told.get_or_insert_with(|| {
                format!("The clock wraps at {name}, first in {}; its time goes on there.", place(row))
            });
        }
        before = raw;
        time[row] = raw + added;
    }
    told
}

/// Tells a wrong time, which accuses itself and not the right ones behind it, from a new beginning.
fn parted(
    time: &[f64],
    rows: &[usize],
    same: &impl Fn(usize) -> bool,
    place: &impl Fn(usize) -> Place,
    mended: &mut Mended,
) {
    let mut kept: Vec<usize> = Vec::new();
    let mut wrong = Vec::new();
    for (at, &row) in rows.iter().enumerate() {
        let Some(&last) = kept.last().filter(|last| same(row) && time[row] <= time[**last]) else {
            kept.push(row);
            continue;
        };
        let next = rows.get(at + 1).copied().filter(|next| same(*next));
        let goes_on = next.is_none_or(|next| time[next] > time[row]);
        let earlier = kept.len().checked_sub(2).map(|before| kept[before]);
        match (earlier, next) {
            // Without the row before all is well.
            (Some(earlier), _) if goes_on && time[row] > time[earlier] => {
                wrong.push(last);
                kept.pop();
                kept.push(row);
            }
            (_, Some(next)) if time[next] > time[last] => wrong.push(row),
            _ => {
                mended.restarts.push(row);
                kept.push(row);
            }
        }
    }
    mended.notes.extend(wrong.first().map(|row| {
        let (count, place, seconds) = (wrong.len(), place(*row), short(time[*row]));
        format!("Times that do not fit between their neighbours are left out ({count}, the first in {place}: {seconds} s).")
    }));
    mended.dropped.extend(wrong);
    mended.dropped.sort_unstable();
}
