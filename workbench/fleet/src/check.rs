//! One task: one log against what its unit was before.
//!
//! The answer is a function of the log, the model file and the unit's result before, and of nothing else. That result is the latest
//! judged one of the unit that is earlier in time, so the tasks of a unit go in the order of time, and units go in any order. A result
//! names its predecessor by the SHA-256 of the file: where an earlier log comes in late, what follows it is done again.

use crate::manifest::Task;
use crate::store::{After, Kept, Key, SCHEMA, Store, Told, Written, digest, digest_of, unit_name};
use anyhow::{Result, anyhow, ensure};
use std::path::Path;
use truing_core::gap::{self, Options};
use truing_core::outcome::{Outcome, Verdict};
use truing_core::system::effects;
use truing_core::system::model::Model;
use truing_files::log::{self, Columns, Log, Reading};
use truing_files::model;

/// How a task ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// Its result was there.
    There,
    /// The names of the result before explain the log to its floor.
    Unchanged,
    /// The whole library was searched.
    Searched,
}

/// Does a task, unless its result is there.
///
/// An error is one sentence: a file that cannot be read, a log that the unit has already at another time, another log of that time.
pub fn check(task: &Task, store: &Store) -> Result<Done> {
    let unit = unit_name(&task.unit).map_err(|text| anyhow!("--unit: {text}"))?;
    let sheet = truing_files::text(&task.model)?;
    let of_unit = store.of_unit(unit)?;
    let log = digest_of(&task.log)?;
    alone(&of_unit, task, &log)?;
    let before = of_unit.iter().rev().find(|(kept, _)| kept.key.at < task.at && kept.outcome.judged());
    let key = Key {
        schema: SCHEMA.into(),
        unit: unit.into(),
        at: task.at,
        log,
        model: digest(sheet.as_bytes()),
        after: before.map(|(kept, file)| After { log: kept.key.log.clone(), result: file.clone() }),
    };
    if of_unit.iter().any(|(kept, _)| kept.key == key) {
        return Ok(Done::There);
    }
    let before = before.map(|(kept, _)| kept).filter(|kept| kept.key.model == key.model);
    let (outcome, unchanged) = judged(task, before)?;
    store.keep_model(&key.model, &sheet)?;
    store.write(&Written { key: &key, unchanged, outcome: &outcome })?;
    Ok(if unchanged { Done::Unchanged } else { Done::Searched })
}

/// A log belongs to one time of its unit, and a time to one log.
fn alone(of_unit: &[(Kept, String)], task: &Task, log: &str) -> Result<()> {
    let others = |kept: &&(Kept, String)| (kept.0.key.log == log) != (kept.0.key.at == task.at);
    if let Some((kept, _)) = of_unit.iter().find(others) {
        let (what, unit, at) = (task.log.display(), &task.unit, kept.key.at);
        ensure!(kept.key.log != log, "{what}: unit {unit} has this log already, at {at}; give each log once");
        ensure!(
            kept.key.at != task.at,
            "{what}: unit {unit} has another log at {at}; give each its own time"
        );
    }
    Ok(())
}

/// The outcome, and whether nothing new was needed.
fn judged(task: &Task, before: Option<&Kept>) -> Result<(Outcome, bool)> {
    let (model, log, notes) = opened(&task.model, &task.log)?;
    let run = |without: Vec<String>| {
        let options = Options { without, ..Options::default() };
        gap::run(&model, &log, &[], &options, &|_| ())
    };
    let told = |outcome: Outcome| Outcome { notes: [notes.clone(), outcome.notes].concat(), ..outcome };
    // A table is searched in less time than it takes to read.
    let before =
        before.map(|kept| &kept.outcome).filter(|told| told.explained() && matches!(log, Log::Dynamic(_)));
    if let Some(before) = before {
        let outcome = run(all_but(before))?;
        if explains(&outcome, before) {
            return Ok((told(outcome), true));
        }
    }
    Ok((told(run(Vec::new())?), false))
}

/// Model, log and what is to be said of them. Notes name files without their folders: the same files in another place read the same.
fn opened(model: &Path, log: &Path) -> Result<(Model, Log, Vec<String>)> {
    let draft = model::read_draft(model)?;
    let Reading { log: record, notes } = log::open(log, &Columns::of("", draft.stated())?)?;
    let model = gap::completed(draft, &record)?;
    let name = log.file_name().unwrap_or_default().to_string_lossy();
    let notes = notes.into_iter().map(|note| note.replace(&log.display().to_string(), &name)).collect();
    Ok((model, record, notes))
}

/// All effects but those that were named before.
fn all_but(before: &Told) -> Vec<String> {
    let names = before.names();
    let others = effects::LIBRARY.iter().map(|effect| effect.name);
    others.filter(|name| !names.contains(name)).map(str::to_owned).collect()
}

/// True if the same names and no fewer leave nothing.
fn explains(outcome: &Outcome, before: &Told) -> bool {
    let mut names: Vec<&str> = outcome.effects.iter().map(|effect| effect.name.as_str()).collect();
    names.sort_unstable();
    matches!(outcome.verdict, Verdict::Named | Verdict::NothingMissing) && names == before.names()
}
