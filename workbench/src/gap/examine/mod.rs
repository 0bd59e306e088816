//! The file is examined before physics is blamed: wrong units, signs, columns and keys, and a held-out record of another motor.
//!
//! A right model with a missing effect explains most of the motion once friction and a constant are left free; a wrong unit
//! explains nothing until the one factor is put right. So a mistake is told only where the file as it stands explains little with
//! any gain within a factor of three, and a factor from a closed list (60/2π, 180/π, 1000, …) explains most (decision 0285).

mod circuit;
mod drive;
mod excerpt;
mod frozen;
mod held_out;
mod motion;
mod place;
mod rows;
mod suspects;
mod table;
mod timing;

pub use timing::{earlier, notes};

use crate::outcome::{DataFault, Outcome};
use crate::system::log::{Dynamic, Log, Table};
use crate::system::model::Model;
use motion::Motion;
use suspects::Suspect;

/// What is wrong with the files; empty if nothing is.
pub fn faults(model: &Model, log: &Log, holdouts: &[Log]) -> Vec<DataFault> {
    match log {
        Log::Table(table) => of_table(model, table),
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

fn of_table(model: &Model, table: &Table) -> Vec<DataFault> {
    table::fault(model, table).into_iter().collect()
}

fn of_record(model: &Model, record: &Dynamic, holdouts: &[Log]) -> Vec<DataFault> {
    let records = records(holdouts);
    let mut found: Vec<DataFault> = place::fault(record).into_iter().collect();
    found.extend(circuit::fault(model, record));
    // What is derived from a wrong position or beside a wrong current would be accused twice.
    if found.is_empty() {
        found.extend(motion_fault(model, record, &records));
    }
    if found.is_empty() {
        found.extend(rows::fault(model, record));
    }
    if found.is_empty() {
        found.extend(holdouts.iter().filter_map(|other| held_out::fault(model, record, other)));
    }
    found
}

fn records(logs: &[Log]) -> Vec<&Dynamic> {
    logs.iter().filter_map(|log| if let Log::Dynamic(record) = log { Some(record) } else { None }).collect()
}

/// A factor, a sign or a key without which the log does not move as the model says.
fn motion_fault(model: &Model, record: &Dynamic, holdouts: &[&Dynamic]) -> Option<DataFault> {
    let motion = Motion::of(record)?;
    let base = motion::Base::of(model, record.input)?;
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
    let one_way = drive::fault(&motion, record, &base, model.fitted_to_log);
    let suspects = suspects::all(model, record, &base);
    let mut seen: Vec<(f64, &Suspect)> = suspects
        .iter()
        .filter_map(|suspect| Some((suspect.explains(&motion, &base, model)?, suspect)))
        .filter(|(explained, _)| clearly(as_it_stands, *explained))
        .filter(|(_, suspect)| everywhere(&|other| suspect.explains(other, &base, model)))
        .collect();
    seen.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best = seen.first().map_or(0.0, |best| best.0);
    if let Some((with_it, suspect)) = one_way.filter(|it| it.0 > best && clearly(as_it_stands, it.0)) {
        return Some(told(&[(with_it, &suspect)], as_it_stands));
    }
    // A drive that clamps its input is no mistake of the file.
    let clamped = motion.explained_with_a_limit(&base, model.fitted_to_log);
    let as_well = |explained: f64| 1.0 - clamped < EQUAL * (1.0 - explained);
    if seen.is_empty() {
        let fault = any_factor(&motion, model, record, &base, as_it_stands);
        let own = |other: &Motion| other.gain(&base).map(|gain| gain.1);
        return fault.filter(|fault| !as_well(fault.explained_with_it) && everywhere(&own));
    }
    if as_well(best) {
        return None;
    }
    seen.retain(|(explained, _)| 1.0 - explained < EQUAL * (1.0 - best));
    Some(told(&seen, as_it_stands))
}

/// A gain within these factors may be several effects together; a quarter is a count that was not multiplied by four.
const ODD: std::ops::RangeInclusive<f64> = 0.28..=4.0;

/// A gain that is far off, by a factor that is in no list.
fn any_factor(
    motion: &Motion,
    model: &Model,
    record: &Dynamic,
    base: &motion::Base,
    as_it_stands: f64,
) -> Option<DataFault> {
    let (gain, explained) = motion.gain(base)?;
    let odd = !ODD.contains(&gain);
    let told_apart = odd && !model.fitted_to_log && clearly(as_it_stands, explained);
    told_apart.then(|| told(&[(explained, &suspects::of_any_size(record, gain))], as_it_stands))
}

/// A file that explains so much of the motion as it stands is not accused.
const ENOUGH: f64 = 0.98;
/// A mistake must explain so much of the motion once it is put right.
const MOST: f64 = 0.9;
/// What a mistake leaves of the unexplained variance: a quarter is half of the error, which a free friction, load, dead zone or time
/// constant within a factor of two does not take from a right file.
const SHRINKS: f64 = 0.25;
/// Mistakes that leave at most so many times what the best one leaves are told together.
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
    let mut notes = Vec::new();
    let mut cut = |record: &Dynamic| {
        let (kept, note) = frozen::without(record)?;
        notes.push(note);
        Some(kept)
    };
    let own = cut(record);
    let others: Vec<Option<Dynamic>> = records(holdouts).into_iter().map(cut).collect();
    let tables = others.len() < holdouts.len();
    let record = own.as_ref().unwrap_or(record);
    let seen: Vec<&Dynamic> =
        records(holdouts).into_iter().zip(&others).map(|(it, cut)| cut.as_ref().unwrap_or(it)).collect();
    let late = if tables { None } else { timing::late(model, record, &seen) };
    if let Some(rows) = late {
        let moved =
            |record: &&Dynamic| timing::earlier(record, rows).unwrap_or_else(|| (*record).clone()).into();
        notes.push(timing::moved(record, rows));
        let holdouts = Some(seen.iter().map(moved).collect());
        return Right { log: Some(moved(&record)), holdouts, late: rows, notes };
    }
    let changed = !tables && others.iter().any(Option::is_some);
    let holdouts = changed.then(|| seen.into_iter().cloned().map(Log::from).collect());
    Right { log: own.map(Log::from), holdouts, late: 0, notes }
}

/// One fault out of mistakes that explain the same.
fn told(seen: &[(f64, &Suspect)], as_it_stands: f64) -> DataFault {
    let all = |part: fn(&Suspect) -> &str, between: &str| {
        let mut parts: Vec<&str> = seen.iter().map(|(_, suspect)| part(suspect)).collect();
        parts.dedup();
        parts.join(between)
    };
    DataFault {
        place: all(|suspect| &suspect.place, ", "),
        what: all(|suspect| &suspect.what, ", or "),
        explained_as_it_stands: as_it_stands.max(0.0),
        explained_with_it: seen[0].0,
        remedy: all(|suspect| &suspect.remedy, "; or "),
    }
}
