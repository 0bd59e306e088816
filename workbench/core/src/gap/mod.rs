//! The gap workflow in plain words: log → simulate → residual → localise → name → extend.
//!
//! Before it the files are [examined](examine): a wrong unit is no physics.
//!
//! A log is a record over time, which is simulated, or a table of settled speeds, whose equilibria are solved. Both are
//! fitted by one [`solver`](fit::solver) as a [`hypothesis`](fit::hypothesis), grown by one [`beam`], and told as one [`Outcome`].

pub mod acceptance;
pub mod beam;
mod data_sheet;
pub mod dataset;
pub mod examine;
pub mod experiment;
pub mod fit;
mod options;
mod order;
pub mod plots;
pub mod record;
pub mod remainder;
pub mod residual;
pub mod search;
pub mod start_values;
pub mod tables;
pub mod time_base;
mod torque;

use crate::gap::examine::Right;
use crate::gap::search::Progress;
use crate::outcome::Outcome;
use crate::system::log::{Dynamic, Log, Table};
use crate::system::model::Model;
use crate::system::threads::join;
use crate::text::input_error::InputError;
use std::borrow::Cow;

pub use options::{Options, ShareLimits};
pub use record::made_ready;
pub use start_values::completed;

/// Finds where model and log disagree, names what is missing and predicts the held-out data with it. A record whose rows
/// are so far apart that each shows a settled speed is taken as a table.
pub fn run<L: Recorded>(
    model: &Model,
    log: &L,
    holdouts: &[L],
    options: &Options,
    progress: Progress,
) -> Result<Outcome, InputError> {
    let (log, holdouts) = (L::log(log), L::logs(holdouts));
    let right =
        if options.accept_data { Right::default() } else { examine::put_right(model, &log, &holdouts) };
    let log = right.log.map_or(log, Cow::Owned);
    let holdouts = right.holdouts.map_or(holdouts, Cow::Owned);
    let moved = |last: &Dynamic| examine::earlier(last, right.late).unwrap_or_else(|| last.clone());
    let finals = options.finals.iter().map(moved).collect();
    let options = &Options { finals, ..options.clone() };
    let notes = || examine::notes(model, &log);
    let (faults, notes) = join(|| examine::faults(model, &log, &holdouts), notes);
    if !faults.is_empty() && !options.accept_data {
        return Ok(examine::outcome(&log, faults));
    }
    let table = as_table(model, &log);
    // What is said of a sensor is said of motion.
    let notes = if table.is_none() { notes } else { Vec::new() };
    let mut outcome = match table {
        Some(table) => of_table(model, &table, &log, &holdouts, options),
        None => {
            let holdouts: Result<Vec<&Dynamic>, InputError> = holdouts.iter().map(record_of).collect();
            record::run(model, record_of(&log)?, &holdouts?, options, progress)
        }
    }?;
    if let Some(fault) = examine::scale(model, &log, &outcome).filter(|_| !options.accept_data) {
        return Ok(examine::outcome(&log, vec![fault]));
    }
    outcome.data_sheet = data_sheet::contradicted(model, &outcome);
    outcome.notes.splice(0..0, model.notes.iter().cloned());
    outcome.notes.extend(right.notes);
    outcome.notes.extend(examine::early(&log, &outcome.effects));
    outcome.notes.extend(notes);
    outcome.notes.extend(faults.iter().map(|fault| format!("accepted although {}", fault.what)));
    let rate = outcome.grade.false_names().filter(|_| !outcome.effects.is_empty());
    outcome.notes.extend(rate.map(|[wrong, of]| {
        format!("of {of} names that were given with this verdict in drawn cases {wrong} were wrong")
    }));
    Ok(outcome)
}

fn as_table(model: &Model, log: &Log) -> Option<Table> {
    match log {
        Log::Table(table) => Some(table.clone()),
        Log::Dynamic(record) => tables::settled(model, record),
    }
}

/// A log that must be a record over time.
pub fn as_record(log: Log) -> Result<Dynamic, InputError> {
    match log {
        Log::Dynamic(record) => Ok(record),
        Log::Table(table) => Err(no_record(&table)),
    }
}

fn record_of(log: &Log) -> Result<&Dynamic, InputError> {
    match log {
        Log::Dynamic(record) => Ok(record),
        Log::Table(table) => Err(no_record(table)),
    }
}

fn no_record(table: &Table) -> InputError {
    let what = "is a steady-state table, but the log is a record over time; give a record";
    InputError::file(&table.source, what)
}

/// What may be analysed. Long logs are not copied.
pub trait Recorded: Sized {
    /// As a log.
    fn log(&self) -> Cow<'_, Log>;

    /// Several of them.
    fn logs(all: &[Self]) -> Cow<'_, [Log]> {
        all.iter().map(|one| one.log().into_owned()).collect::<Vec<Log>>().into()
    }
}

impl Recorded for Log {
    fn log(&self) -> Cow<'_, Log> {
        Cow::Borrowed(self)
    }

    fn logs(all: &[Self]) -> Cow<'_, [Log]> {
        all.into()
    }
}

impl Recorded for Dynamic {
    fn log(&self) -> Cow<'_, Log> {
        Cow::Owned(self.clone().into())
    }
}

impl Recorded for Table {
    fn log(&self) -> Cow<'_, Log> {
        Cow::Owned(self.clone().into())
    }
}

fn of_table(
    model: &Model,
    table: &Table,
    log: &Log,
    holdouts: &[Log],
    options: &Options,
) -> Result<Outcome, InputError> {
    let source = &table.source;
    let others: Option<Vec<Table>> = holdouts.iter().map(|log| as_table(model, log)).collect();
    let Some(others) = others else {
        let what = "is a steady-state table, but a hold-out is a record over time; give a table";
        return Err(InputError::file(source, what));
    };
    if !options.finals.is_empty() {
        return Err(InputError(format!(
            "--final is for records over time; {source} is a steady-state table: give the rows to --holdout"
        )));
    }
    let mut outcome = tables::run(model, table, &others, &options.without);
    if let Log::Dynamic(record) = log {
        outcome.notes.push(time_unused(model, record));
    }
    Ok(outcome)
}

/// A time column never goes unused in silence.
fn time_unused(model: &Model, record: &Dynamic) -> String {
    let apart_s = record.runs[0].sample_s();
    let answered = match tables::answers(&record.runs[0]) {
        tables::Answers::Previous => "the input of the row before, which was held until then",
        tables::Answers::Own => "the input of its own row: with it, equal inputs have equal speeds",
    };
    format!(
        "The rows are {apart_s:.3} s apart, the model's time constant is {:.3} s: each row is taken as a settled speed, and the \
         time is not used. Each speed answers {answered}. If the time is not in seconds, map it, e.g. --columns \"t_ms=t_s\".",
        tables::time_constant_s(model)
    )
}
