//! The file is examined before physics is blamed: wrong units, signs, columns and keys, and a held-out record of another motor.
//!
//! A right model with a missing effect explains most of the motion once friction and a constant are left free; a wrong unit
//! explains nothing until the one factor is put right. So a mistake is told only where the file as it stands explains little with
//! any gain within a factor of three, and a factor from a closed list (60/2π, 180/π, 1000, …) explains most (decision 0285).

mod circuit;
mod excerpt;
mod held_out;
mod motion;
mod place;
mod rows;
mod suspects;
mod table;
mod timing;

pub use timing::notes;

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
    let mut found: Vec<DataFault> = place::fault(record).into_iter().collect();
    found.extend(circuit::fault(model, record));
    found.extend(timing::early(model, record));
    // What is derived from a wrong position or beside a wrong current would be accused twice.
    if found.is_empty() {
        found.extend(motion_fault(model, record));
    }
    if found.is_empty() {
        found.extend(rows::fault(model, record));
    }
    if found.is_empty() {
        found.extend(holdouts.iter().filter_map(|other| held_out::fault(model, record, other)));
    }
    found
}

/// A factor, a sign or a key without which the log does not move as the model says.
fn motion_fault(model: &Model, record: &Dynamic) -> Option<DataFault> {
    let motion = Motion::of(record)?;
    let base = motion::Base::of(model, record.input)?;
    let as_it_stands = motion.explained_within(&base, model.fitted_to_log);
    if as_it_stands > ENOUGH {
        return None;
    }
    let suspects = suspects::all(model, record, &base);
    let mut seen: Vec<(f64, &Suspect)> = suspects
        .iter()
        .filter_map(|suspect| Some((suspect.explains(&motion, &base, model)?, suspect)))
        .filter(|(explained, _)| clearly(as_it_stands, *explained))
        .collect();
    seen.sort_by(|a, b| b.0.total_cmp(&a.0));
    // A drive that clamps its input is no mistake of the file.
    let clamped = motion.explained_with_a_limit(&base, model.fitted_to_log);
    let as_well = |explained: f64| 1.0 - clamped < EQUAL * (1.0 - explained);
    if seen.is_empty() {
        let fault = any_factor(&motion, model, record, &base, as_it_stands);
        return fault.filter(|fault| !as_well(fault.explained_with_it));
    }
    let best = seen[0].0;
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
/// What a mistake leaves unexplained, relative to what the file as it stands does.
const SHRINKS: f64 = 0.25;
/// Mistakes that leave at most so many times what the best one leaves are told together.
const EQUAL: f64 = 1.15;

/// True if a mistake explains the motion, and the file as it stands does not.
fn clearly(as_it_stands: f64, explained: f64) -> bool {
    explained > MOST && 1.0 - explained < SHRINKS * (1.0 - as_it_stands)
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
