//! The rows of a record: lost, doubled, or not as far apart as the time column says.
//!
//! From row to row the shaft goes its speed times the time between them, where both are logged. Where the time column is
//! even and one step is twice as long as it should be, a row is missing; where many ways differ, the clock was not even.

use super::motion::{Base, Motion};
use super::suspects::speed_column;
use super::{clearly, excerpt};
use crate::outcome::DataFault;
use crate::system::log::{Dynamic, Run, median};
use crate::system::model::Model;
use std::ops::Range;

/// A time column is even if its steps differ by less than this part. Chosen by judgement, tried with the others of
/// `examine`.
const EVEN: f64 = 1e-3;
/// A way is judged where it should be at least so many steps of the encoder long. Chosen by judgement, tried with the
/// others of `examine`.
const STEPS: f64 = 12.0;
/// And where the speed at its ends differs by less than this part of their sum: its mean is then that of the speed
/// between them. Chosen by judgement, tried with the others of `examine`.
const STEADY: f64 = 0.1;
/// A lost row makes a step of two rows, two lost ones of three, within this part of a row. Chosen by judgement, tried
/// with the others of `examine`.
const NEAR: f64 = 0.25;
/// No way lies between that of one row and that of two, unless noise makes it. Chosen by judgement, tried with the
/// others of `examine`.
const BETWEEN: Range<f64> = 1.3..1.7;
/// A record with fewer steps that can be judged is not judged. Chosen by judgement, tried with the others of
/// `examine`.
const FEWEST: usize = 60;
/// Lost rows are told from so many on, and from this share of the judged ones. Chosen by judgement, tried with the
/// others of `examine`.
const LOST: (usize, f64) = (4, 2e-3);
/// Steps near two rows, as a multiple of those that noise makes. Chosen by judgement, tried with the others of
/// `examine`.
const CLEAR: usize = 4;
/// Ways that spread by more than this part, and by this many times their own resolution, come from a clock that is
/// not even. Chosen by judgement, tried with the others of `examine`.
const SPREAD: (f64, f64) = (0.05, 4.0);
/// Of two rows with all readings alike one is a copy: from this share of the moving rows on, and so many. Chosen by
/// judgement, tried with the others of `examine`.
const DOUBLED: (f64, usize) = (3e-3, 6);
/// A sensor that is read at every second row, or less often, repeats this share of its values. Chosen by judgement,
/// tried with the others of `examine`.
const HELD: f64 = 0.4;
/// Share of the repeated rows that have another input than the row before: of copies none has. Chosen by judgement,
/// tried with the others of `examine`.
const STALE: f64 = 0.05;
/// Share of the values of a speed that differ from all others: a coarse speed repeats itself. Chosen by judgement,
/// tried with the others of `examine`.
const FINE: f64 = 0.4;
/// Above this part of the fastest motion the shaft turns; above the other one a reading may be clamped. Chosen by
/// judgement, tried with the others of `examine`.
const TURNS: Range<f64> = 0.1..0.97;

/// Lost or doubled rows behind an even time column.
pub fn fault(model: &Model, record: &Dynamic) -> Option<DataFault> {
    if !even(record) {
        return None;
    }
    let place = format!("t_s, {}", speed_column(record));
    if let Some(copies) = repeated(record).filter(|copies| !copies.old) {
        let rows = copies.rows;
        let copy = |run, row| -f64::from(rows.binary_search(&(run, row)).is_ok());
        let count = rows.len();
        let what = format!(
            "rows are doubled and t_s goes on: {count} rows repeat the one before although the shaft turns"
        );
        let remedy = "remove the rows that repeat, or log the time of each row";
        return Some(super::fault(place, what, remedy, mended(model, record, &copy)?));
    }
    let steps = steps(record);
    let lost = lost(&steps)?;
    let longer =
        |run: usize, row: usize| lost.iter().find(|it| (it.0, it.1) == (run, row)).map_or(0.0, |it| it.2);
    let (count, places, row) = (lost.len(), steps.len(), lost[0].1 + 1);
    let what = format!(
        "rows are missing and t_s does not show it: in {count} of {places} places the shaft goes on by two or three rows, first behind row {row}"
    );
    let explained = mended(model, record, &longer)?;
    Some(super::fault(place, what, "log the time of each row with the row", explained))
}

/// What may be said of the clock, or of a sensor that is read less often than rows are written.
pub fn note(model: &Model, record: &Dynamic) -> Option<String> {
    // Differences of counts repeat.
    if !even(record) || model.sensors.speed_window_s > 0.0 && model.encoder.is_some() {
        return None;
    }
    if let Some(held) = repeated(record).filter(|held| held.old) {
        return Some(format!(
            "{:.0} % of the rows repeat {} of the row before although the shaft turns: the sensor is read less often than rows are written, and \
             looks late for it",
            100.0 * held.share,
            speed_column(record)
        ));
    }
    let ways = steps(record);
    if ways.len() < FEWEST {
        return None;
    }
    let middle = |of: &dyn Fn(&Step) -> f64| median(&mut ways.iter().map(of).collect::<Vec<f64>>());
    let spread = 1.4826 * middle(&|way| (way.ratio - 1.0).abs());
    // A difference of two roundings: a step over √6; the speed beside it adds about half of that.
    let resolution = 0.5 * middle(&|way| way.resolution);
    (spread > SPREAD.0.max(SPREAD.1 * resolution)).then(|| {
        format!(
            "the rows look less evenly apart than t_s says: from row to row the way of the shaft spreads by {:.0} % about its speed. If t_s was \
             counted, log the time of each row",
            100.0 * spread
        )
    })
}

/// A step from a row to the next, over what it should be.
struct Step {
    run: usize,
    /// The row that it starts from.
    row: usize,
    ratio: f64,
    /// Spread that the encoder's steps give the ratio.
    resolution: f64,
}

/// The steps of a record whose position is logged beside its speed.
fn steps(record: &Dynamic) -> Vec<Step> {
    record.runs.iter().enumerate().filter_map(|(run, it)| ways(run, it)).flatten().collect()
}

/// Ways by the position over ways by the speed.
fn ways(index: usize, run: &Run) -> Option<Vec<Step>> {
    let (position, speed) = (run.position.as_ref()?, run.speed.as_ref()?);
    let steps: Vec<f64> = position.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let longest = steps.iter().fold(0.0_f64, |most, step| most.max(step.abs()));
    // The smallest step that is more than rounding is the encoder's.
    let smallest =
        steps.iter().map(|step| step.abs()).filter(|step| *step > 1e-6 * longest).fold(longest, f64::min);
    let slow = TURNS.start * speed.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let rows = excerpt::looked_at(steps.len()).into_iter().flatten();
    let judged = rows.filter_map(|row| {
        let step = steps[row];
        let expected = 0.5 * (speed[row] + speed[row + 1]) * (run.t_s[row + 1] - run.t_s[row]);
        let steady = (speed[row + 1] - speed[row]).abs() < STEADY * (speed[row + 1] + speed[row]).abs();
        let (ratio, resolution) = (step / expected, smallest / expected.abs());
        let shows = steady && speed[row].abs() > slow && expected.abs() > STEPS * smallest;
        shows.then_some(Step { run: index, row, ratio, resolution })
    });
    Some(judged.collect())
}

/// Run, row and the rows that are missing behind it, in order.
fn lost(steps: &[Step]) -> Option<Vec<(usize, usize, f64)>> {
    let near = |it: &&Step| [2.0, 3.0].into_iter().any(|rows| (it.ratio - rows).abs() < NEAR * rows / 2.0);
    let lost: Vec<_> =
        steps.iter().filter(near).map(|step| (step.run, step.row, step.ratio.round() - 1.0)).collect();
    let by_noise = steps.iter().filter(|step| BETWEEN.contains(&step.ratio)).count();
    let many =
        steps.len() >= FEWEST && lost.len() >= LOST.0 && lost.len() as f64 > LOST.1 * steps.len() as f64;
    // Were a third lost, most steps would be whole multiples of a longer one. Chosen by judgement; not studied.
    (many && lost.len() > CLEAR * by_noise && (lost.len() as f64) < 0.3 * steps.len() as f64).then_some(lost)
}

/// Rows that repeat every reading of the row before.
struct Repeated {
    /// Run and row, in order.
    rows: Vec<(usize, usize)>,
    /// Their share of the rows in which the shaft turns.
    share: f64,
    /// True if they are old readings beside a new input, or so many that the sensor must be slower than the rows; else the rows are copies.
    old: bool,
}

fn repeated(record: &Dynamic) -> Option<Repeated> {
    let (mut rows, mut values, mut stale) = (Vec::new(), Vec::new(), 0);
    for (index, run) in record.runs.iter().enumerate() {
        let speed = run.speed.as_ref()?;
        let fastest = speed.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        for row in 1..run.rows() {
            let same = |column: &Option<Vec<f64>>| column.as_ref().is_none_or(|it| it[row] == it[row - 1]);
            if !TURNS.contains(&(speed[row].abs() / fastest.max(1e-300))) {
                continue;
            }
            values.push(speed[row].to_bits());
            if speed[row] == speed[row - 1] && same(&run.position) && same(&run.current_a) {
                stale += usize::from(run.input[row] != run.input[row - 1]);
                rows.push((index, row));
            }
        }
    }
    let moving = values.len();
    values.sort_unstable();
    values.dedup();
    let fine = values.len() as f64 > FINE * (moving - rows.len()) as f64;
    let (count, share) = (rows.len(), rows.len() as f64 / moving as f64);
    let many = moving >= FEWEST && count >= DOUBLED.1 && share > DOUBLED.0;
    let old = share > HELD || stale as f64 > STALE * count as f64;
    (fine && many).then_some(Repeated { rows, share, old })
}

/// What is explained as it stands, and with the time of every row corrected by the rows that are missing behind (more than 0) or that are a
/// copy of the one before (−1). None if that explains nothing.
fn mended(model: &Model, record: &Dynamic, rows: &dyn Fn(usize, usize) -> f64) -> Option<[f64; 2]> {
    let base = Base::of(&model.kind, record.input)?;
    let runs = record.runs.iter().enumerate().map(|(index, run)| corrected(run, &|row| rows(index, row)));
    let corrected = Dynamic { runs: runs.collect(), ..record.clone() };
    let explained = |record: &Dynamic| Some(Motion::of(record)?.near(&base, 1.0)?.explained);
    let (as_it_stands, with_it) = (explained(record)?, explained(&corrected)?);
    // Where the way of the shaft shows it, a fit need only agree: it may explain most of the motion beside lost rows.
    let evident = record.runs.iter().all(|run| run.position.is_some() && run.speed.is_some());
    let agrees = if evident { with_it > as_it_stands } else { clearly(as_it_stands, with_it) };
    agrees.then_some([as_it_stands, with_it])
}

fn corrected(run: &Run, rows: &dyn Fn(usize) -> f64) -> Run {
    let step = run.sample_s();
    let mut corrected = run.clone();
    let (mut later, mut kept) = (0.0, Vec::with_capacity(run.rows()));
    for row in 0..run.rows() {
        let more = rows(row);
        if more >= 0.0 {
            kept.push(row);
            corrected.t_s[row] += later;
        }
        later += more * step;
    }
    corrected.keep(&kept);
    corrected
}

/// True if the time column says that all rows are equally far apart.
fn even(record: &Dynamic) -> bool {
    record.runs.iter().all(|run| {
        let step = run.sample_s();
        run.t_s.windows(2).all(|pair| ((pair[1] - pair[0]) / step - 1.0).abs() < EVEN)
    })
}
