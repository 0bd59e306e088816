//! Rows that belong to another time: a speed before its input, a speed that was smoothed, a speed in steps.

use super::motion::{Base, Motion};
use super::rows;
use super::suspects::speed_column;
use crate::gap::threads::each;
use crate::outcome::DataFault;
use crate::system::log::{Dynamic, Log};
use crate::system::model::{Model, SpeedSensor};
use rayon::prelude::*;

/// Rows by which a speed may stand too early.
const EARLY: [usize; 3] = [1, 2, 3];
/// A shift must explain so much of the motion,
const MOST: f64 = 0.98;
/// and leave at most this part of what is left without it.
const SHRINKS: f64 = 0.4;
/// Rows on either side over which a speed may have been smoothed.
const REACHES: [usize; 7] = [2, 3, 5, 7, 10, 15, 20];
/// Steps of a speed below this part of its range harm nobody.
const COARSE: f64 = 0.01;

/// A speed that answers before it was asked.
pub fn early(model: &Model, record: &Dynamic) -> Option<DataFault> {
    let base = Base::of(model, record.input)?;
    let motion = Motion::of(record)?;
    let as_it_stands = motion.explained_with_a_dead_zone(&base)?;
    let shifted = |rows: usize| Some((rows, motion.shifted(rows)?.explained_with_a_dead_zone(&base)?));
    let (rows, with_it) = each(EARLY).filter_map(shifted).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (with_it > MOST && 1.0 - with_it < SHRINKS * (1.0 - as_it_stands)).then(|| {
        let (column, input) = (speed_column(record), record.input.column());
        let many = if rows == 1 { "one row".to_owned() } else { format!("{rows} rows") };
        DataFault {
            place: format!("{column}, {input}"),
            what: format!("{column} stands {many} too early: it answers before {input} changes"),
            explained_as_it_stands: as_it_stands.max(0.0),
            explained_with_it: with_it,
            remedy: format!(
                "read {input} and {column} at the same instant, or move {input} up by {many} in the file"
            ),
        }
    })
}

/// What may be said of the sensor before a compliance or a lag is: nothing of it stops anybody.
pub fn notes(model: &Model, log: &Log) -> Vec<String> {
    let Log::Dynamic(record) = log else { return Vec::new() };
    smoothed(model, record).into_iter().chain(in_steps(model, record)).chain(rows::note(record)).collect()
}

/// A speed that is a mean over rows before and after.
fn smoothed(model: &Model, record: &Dynamic) -> Option<String> {
    if model.sensors.speed != SpeedSensor::Unknown || record.runs.iter().any(|run| run.speed.is_none()) {
        return None;
    }
    let base = Base::of(model, record.input)?;
    let motion = Motion::of(record)?;
    let sharp = motion.explained_with_a_dead_zone(&base)?;
    let seen = |reach: usize| Some((reach, motion.smoothed(reach)?.explained_with_a_dead_zone(&base)?));
    let (reach, with_it) = each(REACHES).filter_map(seen).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (with_it > MOST && 1.0 - with_it < SHRINKS * (1.0 - sharp)).then(|| {
        let window_s = (2 * reach + 1) as f64 * record.runs[0].sample_s();
        format!(
            "{} looks smoothed over about {} rows before and after each: if so, state it in the model, [sensors] speed = \"encoder_difference_centred\", \
             speed_window_s = {}",
            speed_column(record),
            2 * reach + 1,
            crate::report::figure(window_s)
        )
    })
}

/// A speed whose values lie on a coarse grid that the model does not state.
fn in_steps(model: &Model, record: &Dynamic) -> Option<String> {
    if model.encoder.is_some() {
        return None;
    }
    let mut speeds: Vec<f64> =
        record.runs.iter().filter_map(|run| run.speed.as_ref()).flatten().copied().collect();
    let rows = speeds.len();
    speeds.sort_unstable_by(f64::total_cmp);
    let range = speeds.last()? - speeds.first()?;
    let mut levels = speeds;
    levels.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * range);
    let mut gaps: Vec<f64> = levels.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.sort_unstable_by(f64::total_cmp);
    let step = *gaps.get(gaps.len() / 2)?;
    (levels.len() * 20 < rows && step > COARSE * range).then(|| {
        format!(
            "{} comes in steps of {}, which the model does not state: log the position, or give [encoder] counts_per_rev and [sensors] speed_window_s",
            speed_column(record),
            crate::report::figure(step)
        )
    })
}
