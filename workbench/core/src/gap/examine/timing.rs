//! Rows that belong to another time: a speed before its input, a speed that was smoothed, a speed in steps.

use super::motion::{Base, Motion};
use super::rows;
use super::suspects::speed_column;
use crate::outcome::NamedEffect;
use crate::system::effects::TRANSPORT_DELAY;
use crate::system::log::{Dynamic, Log, Run, median};
use crate::system::model::{Model, SpeedSensor};
use crate::system::threads::*;

/// An input that stands later than this is another record, s and rows. Chosen by judgement, tried with the others of
/// `examine`.
const LATEST_S: f64 = 0.2;
const LATEST_ROWS: f64 = 2000.0;
/// Delays up to this, s, and one row are tried first. Chosen by judgement, tried with the others of `examine`.
const SOON_S: f64 = 0.003;
/// Shorter runs are not moved. Chosen by judgement, tried with the others of `examine`.
const SHORTEST: usize = 20;
/// A shift must explain so much of the motion. Chosen by judgement, tried with the others of `examine`.
const MOST: f64 = 0.98;
/// And it must leave at most this part of what is left without it. Chosen by judgement, tried with the others of
/// `examine`.
const SHRINKS: f64 = 0.4;
/// A jump of the input is so much of its largest value, and stands alone among so many rows. Fewer jumps tell
/// nothing. Chosen by judgement, tried with the others of `examine`.
const JUMP: f64 = 0.2;
const AROUND_JUMP: usize = 4;
const JUMPS: usize = 8;
/// The acceleration changes in one row by so many times more than in any other: a central difference halves it.
/// Chosen by judgement, tried with the others of `examine`.
const ALONE: f64 = 3.0;
/// Rows on either side over which a speed may have been smoothed. Chosen by judgement, tried with the others of
/// `examine`.
const REACHES: [usize; 7] = [2, 3, 5, 7, 10, 15, 20];
/// Steps of a speed below this part of its range harm nobody. Chosen by judgement, tried with the others of
/// `examine`.
const COARSE: f64 = 0.01;

/// By how many rows the input stands late: the motion answers before it changes, in the log and in every held-out record. Nothing but a
/// logger does so.
pub fn late(model: &Model, record: &Dynamic, holdouts: &[&Dynamic]) -> Option<usize> {
    let base = Base::of(&model.kind, record.input)?;
    let left = |record: &Dynamic, rows: usize| {
        let motion = Motion::of(&earlier(record, rows)?)?;
        Some(1.0 - motion.explained_with_a_dead_zone(&base)?)
    };
    let step_s = record.runs[0].sample_s();
    let most = (LATEST_S / step_s).round().clamp(1.0, LATEST_ROWS) as usize;
    let first = (SOON_S / step_s).round().clamp(1.0, most as f64) as usize;
    let as_it_stands = left(record, 0)?;
    // Of a right file the first rows already make it worse.
    let (mut rows, mut best) = [1, first]
        .map(|rows| (rows, left(record, rows).unwrap_or(f64::INFINITY)))
        .into_iter()
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    if best >= as_it_stands {
        return None;
    }
    let mut step = rows;
    let mut growing = true;
    while step > 0 {
        let tried =
            [rows + step, rows.saturating_sub(step)].into_iter().filter(|rows| (1..=most).contains(rows));
        let better = tried.filter_map(|rows| Some((rows, left(record, rows)?))).find(|it| it.1 < best);
        match better {
            Some(found) => (rows, best) = found,
            None => growing = false,
        }
        step = if growing { 2 * step } else { step / 2 };
    }
    // What explains nearly all as it stands is moved by a jump alone: a dead zone between two that are tried looks like a row.
    let clearly = |record: &Dynamic, before: f64, after: f64| {
        after < before && (before > 1.0 - MOST && after < SHRINKS * before || answers_before(record, rows))
    };
    let everywhere = |other: &&Dynamic| {
        left(other, 0).zip(left(other, rows)).is_none_or(|(before, after)| clearly(other, before, after))
    };
    (1.0 - best > MOST && clearly(record, as_it_stands, best) && holdouts.iter().all(everywhere))
        .then_some(rows)
}

/// Does the acceleration change so many rows before the input jumps, and nowhere else around the jump? One row hides behind the friction
/// that a fit to the whole motion leaves over.
fn answers_before(record: &Dynamic, rows: usize) -> bool {
    let reach = rows + AROUND_JUMP;
    let (mut answers, mut jumps) = (vec![0.0; 2 * reach], 0);
    for run in &record.runs {
        let Some(speed) = &run.speed else { continue };
        let change = |row: usize| run.input[row] - run.input[row - 1];
        let far = JUMP * run.input.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        for row in reach + 1..run.rows().saturating_sub(reach + 1) {
            // A tenth of the jump beside it moves its middle by less than a tenth of a row. Chosen by judgement; not studied.
            let alone = |other: usize| other == row || change(other).abs() < 0.1 * change(row).abs();
            if change(row).abs() > far && (row - reach..row + reach).all(alone) {
                jumps += 1;
                for (k, answer) in answers.iter_mut().enumerate() {
                    let at = row - reach + k;
                    *answer += change(row) * (speed[at + 1] - 2.0 * speed[at] + speed[at - 1]);
                }
            }
        }
    }
    let own = answers[reach - rows];
    let other = (0..answers.len()).filter(|k| *k != reach - rows).map(|k| answers[k].abs());
    jumps >= JUMPS && own > ALONE * other.fold(0.0, f64::max)
}

/// The record with every input moved up by some rows. What is shorter than that is left out.
pub fn earlier(record: &Dynamic, rows: usize) -> Option<Dynamic> {
    let moved = |run: &Run| {
        let kept = run.rows() - rows;
        Run {
            input: run.input[rows..].to_vec(),
            bridge: run.bridge[rows..].to_vec(),
            ..run.rows_between(0, kept, run.id)
        }
    };
    let runs: Vec<Run> = record.runs.iter().filter(|run| run.rows() > rows + SHORTEST).map(moved).collect();
    (!runs.is_empty()).then(|| Dynamic { runs, ..record.clone() })
}

/// What is said of an input that was moved.
pub fn moved(record: &Dynamic, rows: usize) -> String {
    let (column, input) = (speed_column(record), record.input.column());
    let many = if rows == 1 { "one row".to_owned() } else { format!("{rows} rows") };
    format!(
        "{input} is logged {many} ({} ms) late: {column} answers before it changes, too early by {many}. It is read {many} earlier here; log \
         both at the same instant. To read it as it stands: --accept-data",
        crate::text::figures::figure(1e3 * rows as f64 * record.runs[0].sample_s())
    )
}

/// A delay that was named may stand in the file: an input that is logged before it acts looks the same.
pub fn early(log: &Log, effects: &[NamedEffect]) -> Option<String> {
    let Log::Dynamic(record) = log else { return None };
    let delay = effects.iter().find(|effect| effect.name == TRANSPORT_DELAY.name)?;
    let ms = crate::text::figures::figure(1e3 * delay.parameters.values().next()?.value);
    let input = record.input.column();
    Some(format!(
        "{input} logged {ms} ms early would look like this delay: if nothing delays it, log both at the same instant"
    ))
}

/// What may be said of the sensor before a compliance or a lag is: nothing of it stops anybody.
pub fn notes(model: &Model, log: &Log) -> Vec<String> {
    let Log::Dynamic(record) = log else { return Vec::new() };
    smoothed(model, record)
        .into_iter()
        .chain(in_steps(model, record))
        .chain(rows::note(model, record))
        .collect()
}

/// A speed that is a mean over rows before and after.
fn smoothed(model: &Model, record: &Dynamic) -> Option<String> {
    if model.sensors.speed != SpeedSensor::Unknown || record.runs.iter().any(|run| run.speed.is_none()) {
        return None;
    }
    let base = Base::of(&model.kind, record.input)?;
    let motion = Motion::of(record)?;
    let sharp = motion.explained_with_a_dead_zone(&base)?;
    let seen = |reach: usize| Some((reach, motion.smoothed(reach).explained_with_a_dead_zone(&base)?));
    let (reach, with_it) = each(REACHES).filter_map(seen).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (with_it > MOST && 1.0 - with_it < SHRINKS * (1.0 - sharp)).then(|| {
        let window_s = (2 * reach + 1) as f64 * record.runs[0].sample_s();
        format!(
            "{} looks smoothed over about {} rows before and after each: if so, state it in the model, [sensors] speed = \"encoder_difference_centred\", \
             speed_window_s = {}",
            speed_column(record),
            2 * reach + 1,
            crate::text::figures::figure(window_s)
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
    speeds.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * range);
    let mut gaps: Vec<f64> = speeds.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let step = median(&mut gaps);
    (speeds.len() * 20 < rows && step > COARSE * range).then(|| {
        format!(
            "{} comes in steps of {}, which the model does not state: log the position, or give [encoder] counts_per_rev and [sensors] speed_window_s",
            speed_column(record),
            crate::text::figures::figure(step)
        )
    })
}
