//! The file is examined before physics is blamed: wrong units, signs, columns and keys, and a held-out record of another motor.
//!
//! A right model with a missing effect explains most of the motion once friction and a constant are left free; a wrong unit
//! explains nothing until the one factor is put right. So a mistake is told only where the file as it stands explains little with
//! any gain within a factor of three, and a factor from a closed list (60/2π, 180/π, 1000, …) explains most (decision 0285).
//!
//! The thresholds were chosen by judgement and tried together, on drawn files with mistakes and without (evaluations `mistakes` and
//! `accused`, docs/results/README.md), until no right file was accused. None was studied alone.

mod circuit;
mod drive;
mod excerpt;
mod frozen;
mod held_out;
pub mod motion;
mod place;
mod rows;
pub mod stretch;
mod suspects;
mod table;
mod timing;

pub use timing::{earlier, early, notes};

use crate::gap::order::by_least;
use crate::outcome::{DataFault, Outcome};
use crate::system::effects;
use crate::system::log::{Dynamic, Log};
use crate::system::model::Model;
use motion::Motion;
use std::borrow::Cow;
use suspects::Suspect;

/// What is wrong with the files; empty if nothing is.
pub fn faults(model: &Model, log: &Log, holdouts: &[Log]) -> Vec<DataFault> {
    match log {
        Log::Table(table) => table::fault(model, table).into_iter().collect(),
        Log::Dynamic(record) => of_record(model, record, holdouts),
    }
}

/// The result where the files are at fault: nothing was simulated.
pub fn outcome(log: &Log, faults: Vec<DataFault>) -> Outcome {
    let (signal, unit) = match log {
        Log::Dynamic(record) if record.linear => ("v_m_s", "m/s"),
        _ => ("omega_rad_s", "rad/s"),
    };
    Outcome::at_fault(signal, unit, faults)
}

fn of_record(model: &Model, record: &Dynamic, holdouts: &[Log]) -> Vec<DataFault> {
    let others = records(holdouts);
    let found: Vec<DataFault> =
        [place::fault(record), circuit::fault(model, record, &others)].into_iter().flatten().collect();
    // What is derived from a wrong position or beside a wrong current would be accused twice.
    if !found.is_empty() {
        return found;
    }
    match motion_fault(model, record, &others).or_else(|| rows::fault(model, record)) {
        Some(fault) => vec![fault],
        None => holdouts.iter().filter_map(|other| held_out::fault(model, record, other)).collect(),
    }
}

fn records(logs: &[Log]) -> Vec<&Dynamic> {
    logs.iter().filter_map(|log| if let Log::Dynamic(record) = log { Some(record) } else { None }).collect()
}

/// A factor, a sign or a key without which the log does not move as the model says.
fn motion_fault(model: &Model, record: &Dynamic, holdouts: &[&Dynamic]) -> Option<DataFault> {
    let motion = Motion::of(record)?;
    let base = motion::Base::of(&model.kind, record.input)?;
    let as_it_stands = motion.explained_within(&base, model.fitted_to_log);
    if as_it_stands > ENOUGH {
        return None;
    }
    let others: Vec<Motion> = holdouts.iter().filter_map(|other| Motion::of(other)).collect();
    let everywhere = |explains: &dyn Fn(&Motion) -> Option<f64>| {
        let better = |other: &Motion| {
            let before = other.explained_within(&base, model.fitted_to_log);
            before > ENOUGH || explains(other).is_some_and(|after| shrinks(before, after))
        };
        others.iter().all(better)
    };
    let by_drive = |makes: drive::Makes| {
        move |other: &Motion| Some(other.driven_by(makes).explained_within(&base, model.fitted_to_log))
    };
    let one_way = drive::fault(&motion, record, &base, model.fitted_to_log)
        .filter(|(explained, _, makes)| clearly(as_it_stands, *explained) && everywhere(&by_drive(*makes)));
    let suspects = suspects::all(model, record, &base);
    let mut seen: Vec<(f64, &Suspect)> = suspects
        .iter()
        .filter_map(|suspect| Some((suspect.explains(&motion, &base, model)?, suspect)))
        .filter(|(explained, _)| clearly(as_it_stands, *explained))
        .filter(|(_, suspect)| everywhere(&|other| suspect.explains(other, &base, model)))
        .collect();
    by_least(&mut seen, |it| -it.0);
    let best = seen.first().map_or(0.0, |best| best.0);
    if let Some((with_it, suspect, _)) = one_way.filter(|it| it.0 > best) {
        return Some(told(&[(with_it, &suspect)], as_it_stands));
    }
    // A drive that clamps its input or has a threshold is no mistake of the file.
    let by_a_drive = motion.explained_by_a_drive(&base, model.fitted_to_log);
    let as_well = |explained: f64| 1.0 - by_a_drive < EQUAL * (1.0 - explained);
    if seen.is_empty() {
        // A gain that is far off, by a factor that is in no list.
        let own = |other: &Motion| other.gain(&base).map(|gain| gain.1);
        let (gain, explained) = motion.gain(&base)?;
        let odd = !ODD.contains(&gain) && !model.fitted_to_log && clearly(as_it_stands, explained);
        return (odd && !as_well(explained) && everywhere(&own))
            .then(|| told(&[(explained, &suspects::of_any_size(record, gain))], as_it_stands));
    }
    if as_well(best) {
        return None;
    }
    seen.retain(|(explained, _)| 1.0 - explained <= EQUAL * (1.0 - best));
    Some(told(&seen, as_it_stands))
}

/// What is wrong with the files where the analysis ends in a scale that no sensor and no drive has: friction and the like had to be
/// known first.
pub fn scale(model: &Model, log: &Log, outcome: &Outcome) -> Option<DataFault> {
    let Log::Dynamic(record) = log else { return None };
    let scales = [effects::ENCODER_SCALE.name, effects::DRIVE_GAIN.name];
    let found = outcome.effects.iter().find(|effect| scales.contains(&effect.name.as_str()))?;
    let ratio = found.parameters.values().next()?.value;
    let share = |fit_percent: f64| 1.0 - (1.0 - fit_percent / 100.0).powi(2);
    let explained = share(outcome.holdout.fit_percent_after);
    // Below a limit a speed rises more steeply than a line through all of it: that is no mistake of the file.
    let straight = Motion::of(record)?.straight_gain(&motion::Base::of(&model.kind, record.input)?);
    let odd = !ODD.contains(&ratio) && !ODD.contains(&straight) && !model.fitted_to_log && explained > MOST;
    let suspect = suspects::of_any_size(record, ratio);
    odd.then(|| told(&[(explained, &suspect)], share(outcome.holdout.fit_percent_before)))
}

/// A gain within these factors may be several effects together; a quarter is a count that was not multiplied by four.
/// Chosen by judgement, tried with the others of `examine`.
const ODD: std::ops::RangeInclusive<f64> = 0.28..=4.0;

/// A file that explains so much of the motion as it stands is not accused. Chosen by judgement, tried with the others
/// of `examine`.
const ENOUGH: f64 = 0.98;
/// A mistake must explain so much of the motion once it is put right. Chosen by judgement, tried with the others of
/// `examine`.
const MOST: f64 = 0.9;
/// What a mistake leaves of the unexplained variance. Origin: a quarter is half of the error, which a free friction,
/// load, dead zone or time constant within a factor of two does not take from a right file.
const SHRINKS: f64 = 0.25;
/// Mistakes that leave at most so many times what the best one leaves are told together. Chosen by judgement, tried
/// with the others of `examine`.
const EQUAL: f64 = 1.15;

/// True if a mistake explains the motion, and the file as it stands does not. Every accusation passes here.
fn clearly(as_it_stands: f64, explained: f64) -> bool {
    as_it_stands < ENOUGH && explained > MOST && shrinks(as_it_stands, explained)
}

fn shrinks(as_it_stands: f64, explained: f64) -> bool {
    1.0 - explained < SHRINKS * (1.0 - as_it_stands)
}

/// The files with what can be put right without a doubt, and what is said of it.
#[derive(Default)]
pub struct Right {
    /// The log, if something in it was put right.
    pub log: Option<Log>,
    /// The held-out records, likewise.
    pub holdouts: Option<Vec<Log>>,
    /// Rows by which every input was moved up.
    pub late: usize,
    /// Sentences.
    pub notes: Vec<String>,
}

/// Cuts out where a sensor stood still, and moves inputs that were logged late.
pub fn put_right(model: &Model, log: &Log, holdouts: &[Log]) -> Right {
    let Log::Dynamic(record) = log else { return Right::default() };
    let others = records(holdouts);
    if others.len() < holdouts.len() {
        return Right::default();
    }
    let mut right = Right::default();
    let mut records: Vec<Cow<Dynamic>> = [record].into_iter().chain(others).map(Cow::Borrowed).collect();
    for record in &mut records {
        if let Some((kept, note)) = frozen::without(record) {
            *record = Cow::Owned(kept);
            right.notes.push(note);
        }
    }
    let others: Vec<&Dynamic> = records[1..].iter().map(AsRef::as_ref).collect();
    if let Some(rows) = timing::late(model, &records[0], &others) {
        right.late = rows;
        right.notes.push(timing::moved(&records[0], rows));
        for record in &mut records {
            *record = Cow::Owned(timing::earlier(record, rows).unwrap_or_else(|| record.as_ref().clone()));
        }
    }
    let changed = |record: &Cow<Dynamic>| matches!(record, Cow::Owned(_));
    let others = records.split_off(1);
    right.holdouts = others.iter().any(changed).then(|| others.into_iter().map(own).collect());
    right.log = records.pop().filter(changed).map(own);
    right
}

fn own(record: Cow<Dynamic>) -> Log {
    Log::from(record.into_owned())
}

/// One fault out of mistakes that explain the same.
fn told(seen: &[(f64, &Suspect)], as_it_stands: f64) -> DataFault {
    let all = |part: fn(&Suspect) -> &str, between: &str| {
        let mut parts: Vec<&str> = seen.iter().map(|(_, suspect)| part(suspect)).collect();
        parts.dedup();
        parts.join(between)
    };
    let (place, what) = (all(|suspect| &suspect.place, ", "), all(|suspect| &suspect.what, ", or "));
    fault(place, what, all(|suspect| &suspect.remedy, "; or "), [as_it_stands, seen[0].0])
}

/// What is wrong where, what mends it, and what is explained as it stands and with it.
fn fault(
    place: impl Into<String>,
    what: impl Into<String>,
    remedy: impl Into<String>,
    [as_it_stands, explained_with_it]: [f64; 2],
) -> DataFault {
    let (place, what, remedy) = (place.into(), what.into(), remedy.into());
    DataFault { place, what, explained_as_it_stands: as_it_stands.max(0.0), explained_with_it, remedy }
}
