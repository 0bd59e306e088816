//! The rows of a record: lost, doubled, or not as far apart as the time column says.
//!
//! From row to row the shaft goes its speed times the time between them, where both are logged. Where the time column is
//! even and one step is twice as long as it should be, a row is missing; where many ways differ, the clock was not even.

use super::motion::{Base, Motion};
use super::suspects::speed_column;
use super::{clearly, excerpt};
use crate::outcome::DataFault;
use crate::system::log::{Dynamic, Run};
use crate::system::model::Model;
use std::ops::Range;

/// A time column is even if its steps differ by less than this part.
const EVEN: f64 = 1e-3;
/// A way is judged where it should be so many steps of the encoder long.
const STEPS: f64 = 12.0;
/// And where the speed at its ends differs by less than this part of their sum: its mean is then that of the speed between them.
const STEADY: f64 = 0.1;
/// A lost row makes a step of two rows, two lost ones of three, within this part of a row.
const NEAR: f64 = 0.25;
/// Of ways there are none between one row's and two, unless noise makes them.
const BETWEEN: Range<f64> = 1.3..1.7;
/// A record with fewer steps that can be judged is not.
const FEWEST: usize = 60;
/// Lost rows are told from so many on, and from this share of the judged ones.
const LOST: (usize, f64) = (4, 2e-3);
/// So many times more steps are near two rows than noise makes.
const CLEAR: usize = 4;
/// Ways that spread by more than this part, and by this many times their own resolution, come from a clock that is not even.
const SPREAD: (f64, f64) = (0.05, 4.0);
/// Of two rows with all readings alike one is a copy: from this share of the moving rows on, and so many.
const DOUBLED: (f64, usize) = (3e-3, 6);
/// A sensor that is read at every second row, or less often, repeats this share of its values.
const HELD: f64 = 0.4;
/// Share of the repeated rows that have another input than the row before: of copies none has.
const STALE: f64 = 0.05;
/// Share of the values of a speed that differ from all others: a coarse speed repeats itself.
const FINE: f64 = 0.4;
/// Above this part of the fastest motion the shaft turns; above the other one a reading may be clamped.
const TURNS: Range<f64> = 0.1..0.97;

/// Lost or doubled rows behind an even time column.
pub fn fault(model: &Model, record: &Dynamic) -> Option<DataFault> {
    if !even(record) {
        return None;
    }
    let column = speed_column(record);
    if let Some(copies) = copies(record) {
        let fault = told(model, record, &|run, row| if copies.is(run, row) { -1.0 } else { 0.0 })?;
        return Some(DataFault {
            what: format!(
                "rows are doubled and t_s goes on: {} rows repeat the one before although the shaft turns",
                copies.rows.len()
            ),
            remedy: "remove the rows that repeat, or log the time of each row".into(),
            place: format!("t_s, {column}"),
            ..fault
        });
    }
    let steps = steps(record);
    let lost = lost(&steps)?;
    let longer =
        |run: usize, row: usize| lost.iter().find(|it| (it.0, it.1) == (run, row)).map_or(0.0, |it| it.2);
    let fault = told(model, record, &longer)?;
    Some(DataFault {
        what: format!(
            "rows are missing and t_s does not show it: in {} of {} places the shaft goes on by two or three rows, first behind row {}",
            lost.len(),
            steps.len(),
            lost[0].1 + 1
        ),
        remedy: "log the time of each row with the row".into(),
        place: format!("t_s, {column}"),
        ..fault
    })
}

/// What may be said of the clock, or of a sensor that is read less often than rows are written.
pub fn note(record: &Dynamic) -> Option<String> {
    if !even(record) {
        return None;
    }
    if let Some(share) = held(record) {
        return Some(format!(
            "{:.0} % of the rows repeat {} of the row before although the shaft turns: the sensor is read less often than rows are written, and \
             looks late for it",
            100.0 * share,
            speed_column(record)
        ));
    }
    let ways = steps(record);
    if ways.len() < FEWEST {
        return None;
    }
    let spread = 1.4826 * median(ways.iter().map(|way| (way.ratio - 1.0).abs()).collect());
    // A difference of two roundings: a step over √6; the speed beside it adds about half of that.
    let resolution = 0.5 * median(ways.iter().map(|way| way.resolution).collect());
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
        (steady && speed[row].abs() > slow && expected.abs() > STEPS * smallest).then(|| Step {
            run: index,
            row,
            ratio: step / expected,
            resolution: smallest / expected.abs(),
        })
    });
    Some(judged.collect())
}

/// Run, row and the rows that are missing behind it, in order.
fn lost(steps: &[Step]) -> Option<Vec<(usize, usize, f64)>> {
    let near =
        |step: &&Step| [2.0, 3.0].into_iter().any(|rows| (step.ratio - rows).abs() < NEAR * rows / 2.0);
    let lost: Vec<_> =
        steps.iter().filter(near).map(|step| (step.run, step.row, step.ratio.round() - 1.0)).collect();
    let by_noise = steps.iter().filter(|step| BETWEEN.contains(&step.ratio)).count();
    let many =
        steps.len() >= FEWEST && lost.len() >= LOST.0 && lost.len() as f64 > LOST.1 * steps.len() as f64;
    (many && lost.len() > CLEAR * by_noise && (lost.len() as f64) < 0.3 * steps.len() as f64).then_some(lost)
}

/// Rows that repeat the one before.
struct Copies {
    rows: Vec<(usize, usize)>,
}

impl Copies {
    fn is(&self, run: usize, row: usize) -> bool {
        self.rows.binary_search(&(run, row)).is_ok()
    }
}

/// Rows that repeat every reading of the row before, the rows in which the shaft turns, and how many of the repeated ones have an input of
/// their own.
fn repeated(record: &Dynamic) -> Option<(Copies, usize, usize)> {
    let (mut rows, mut stale, mut moving) = (Vec::new(), 0, 0);
    let mut values = Vec::new();
    for (index, run) in record.runs.iter().enumerate() {
        let speed = run.speed.as_ref()?;
        let fastest = speed.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        for row in 1..run.rows() {
            let same = |column: &Option<Vec<f64>>| column.as_ref().is_none_or(|it| it[row] == it[row - 1]);
            if !TURNS.contains(&(speed[row].abs() / fastest.max(1e-300))) {
                continue;
            }
            moving += 1;
            values.push(speed[row].to_bits());
            if speed[row] == speed[row - 1] && same(&run.position) && same(&run.current_a) {
                stale += usize::from(run.input[row] != run.input[row - 1]);
                rows.push((index, row));
            }
        }
    }
    values.sort_unstable();
    values.dedup();
    let fine = values.len() as f64 > FINE * (moving - rows.len()) as f64;
    (moving >= FEWEST && fine && !rows.is_empty()).then_some((Copies { rows }, moving, stale))
}

/// Rows that are copies: all readings alike, the input too.
fn copies(record: &Dynamic) -> Option<Copies> {
    let (copies, moving, stale) = repeated(record)?;
    let count = copies.rows.len();
    let many = count >= DOUBLED.1 && count as f64 > DOUBLED.0 * moving as f64;
    (many && (count as f64) < HELD * moving as f64 && stale as f64 <= STALE * count as f64).then_some(copies)
}

/// The share of rows with old readings beside a new input, or of so many that the sensor must be slower than the rows.
fn held(record: &Dynamic) -> Option<f64> {
    let (copies, moving, stale) = repeated(record)?;
    let (count, share) = (copies.rows.len(), copies.rows.len() as f64 / moving as f64);
    (count >= DOUBLED.1 && (share > HELD || share > DOUBLED.0 && stale as f64 > STALE * count as f64))
        .then_some(share)
}

/// The fault with what it explains: the time of every row corrected by the rows that are missing behind (more than 0) or that are a copy of the
/// one before (−1). None if that explains nothing.
fn told(model: &Model, record: &Dynamic, rows: &dyn Fn(usize, usize) -> f64) -> Option<DataFault> {
    let base = Base::of(model, record.input)?;
    let runs = record.runs.iter().enumerate().map(|(index, run)| corrected(run, &|row| rows(index, row)));
    let corrected = Dynamic { runs: runs.collect(), ..record.clone() };
    let explained = |record: &Dynamic| Some(Motion::of(record)?.near(&base, 1.0)?.explained);
    let (as_it_stands, with_it) = (explained(record)?, explained(&corrected)?);
    // Where the way of the shaft shows it, a fit need only agree: it may explain most of the motion beside lost rows.
    let evident = record.runs.iter().all(|run| run.position.is_some() && run.speed.is_some());
    let agrees = if evident { with_it > as_it_stands } else { clearly(as_it_stands, with_it) };
    agrees.then(|| DataFault {
        place: String::new(),
        what: String::new(),
        explained_as_it_stands: as_it_stands.max(0.0),
        explained_with_it: with_it,
        remedy: String::new(),
    })
}

fn corrected(run: &Run, rows: &dyn Fn(usize) -> f64) -> Run {
    let step = run.sample_s();
    let mut later = 0.0;
    let mut time = Vec::with_capacity(run.rows());
    let mut kept = Vec::with_capacity(run.rows());
    for row in 0..run.rows() {
        let more = rows(row);
        if more < 0.0 {
            later += more * step;
            continue;
        }
        kept.push(row);
        time.push(run.t_s[row] + later);
        later += more * step;
    }
    let pick = |values: &[f64]| kept.iter().map(|row| values[*row]).collect::<Vec<f64>>();
    let some = |values: &Option<Vec<f64>>| values.as_ref().map(|values| pick(values));
    Run {
        t_s: time,
        input: pick(&run.input),
        position: some(&run.position),
        speed: some(&run.speed),
        current_a: some(&run.current_a),
        supply_v: some(&run.supply_v),
        bridge: kept.iter().map(|row| run.bridge[*row]).collect(),
        ..run.clone()
    }
}

/// True if the time column says that all rows are equally far apart.
fn even(record: &Dynamic) -> bool {
    record.runs.iter().all(|run| {
        let step = run.sample_s();
        run.t_s.windows(2).all(|pair| ((pair[1] - pair[0]) / step - 1.0).abs() < EVEN)
    })
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}
