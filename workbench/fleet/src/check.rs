//! One task: one log against what its unit was before.
//!
//! The answer is a function of the log, the model file and the unit's result before, and of nothing else. That result is the latest
//! judged one of the unit that is earlier in time, so the tasks of a unit go in the order of time, and units go in any order. A result
//! names its predecessor by the SHA-256 of the file: where an earlier log comes in late, what follows it is done again. By these names
//! one result stands for all before it, which are the history of the unit's numbers.
//!
//! That the names before explain a log is not enough for it to be unchanged: a new effect may hide in the tolerances of the data sheet,
//! whose numbers then move. So a number that moved is a reason to search.

use crate::manifest::Task;
use crate::series::numbers;
use crate::stats::Point;
use crate::stats::moved::p_value;
use crate::store::{After, Kept, Key, SCHEMA, Store, Told, Written, digest, digest_of, unit_name};
use anyhow::{Result, anyhow, ensure};
use std::collections::BTreeMap;
use std::iter::successors;
use std::path::Path;
use truing_core::gap::{self, Options};
use truing_core::outcome::{Outcome, Verdict};
use truing_core::system::effects;
use truing_core::system::model::Model;
use truing_files::log::{self, Columns, Log, Reading};
use truing_files::model;

/// The share of logs of an unchanged unit that are searched, at most, because a number seems to have moved. A search costs two to six first
/// questions.
const FALSE_ALARMS: f64 = 0.05;
/// A number is compared with so many logs: in time a change that no search could name becomes what the unit is like.
const MEMORY: usize = 20;

/// How a task ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// Its result was there.
    There,
    /// The names of the result before explain the log to its floor, and no number moved.
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
    let (outcome, unchanged, done) = judged(task, &history(&of_unit, &key))?;
    store.keep_model(&key.model, &sheet)?;
    store.write(&Written { key: &key, unchanged, outcome: &outcome })?;
    Ok(done)
}

/// The results on which a task stands, the latest first: each names the one before it. Those of another model file, or with other names than
/// the latest, say nothing of its numbers. Empty where the latest is one of them, or explains its own log badly.
fn history<'a>(of_unit: &'a [(Kept, String)], key: &Key) -> Vec<&'a Told> {
    let named = |key: &Key| {
        let file = &key.after.as_ref()?.result;
        of_unit.iter().find(|(_, its)| its == file).map(|(kept, _)| kept)
    };
    let chain = successors(named(key), |kept| named(&kept.key));
    let usable = |kept: &&Kept| kept.key.model == key.model && kept.outcome.explained();
    let Some(latest) = named(key).filter(|kept| usable(kept)) else {
        return Vec::new();
    };
    let alike = |kept: &&Kept| usable(kept) && kept.outcome.names() == latest.outcome.names();
    chain.filter(alike).take(MEMORY).map(|kept| &kept.outcome).collect()
}

/// A log belongs to one time of its unit, and a time to one log.
fn alone(of_unit: &[(Kept, String)], task: &Task, log: &str) -> Result<()> {
    let others = |(kept, _): &&(Kept, String)| (kept.key.log == log) != (kept.key.at == task.at);
    let Some((Kept { key, .. }, _)) = of_unit.iter().find(others) else {
        return Ok(());
    };
    let (what, unit, at) = (task.log.display(), &task.unit, key.at);
    ensure!(key.log != log, "{what}: unit {unit} has this log already, at {at}; give each log once");
    Err(anyhow!("{what}: unit {unit} has another log at {at}; give each its own time"))
}

/// The outcome, whether nothing new was found, and how.
fn judged(task: &Task, history: &[&Told]) -> Result<(Outcome, bool, Done)> {
    let (model, log, notes) = opened(&task.model, &task.log)?;
    let run = |without: Vec<String>| {
        let options = Options { without, ..Options::default() };
        let outcome = gap::run(&model, &log, &[], &options, &|_| ())?;
        anyhow::Ok(Outcome { notes: [notes.clone(), outcome.notes].concat(), ..outcome })
    };
    // A table is searched in less time than it takes to read.
    let before = history.first().filter(|_| matches!(log, Log::Dynamic(_)));
    let Some(before) = before else {
        return Ok((run(Vec::new())?, false, Done::Searched));
    };
    let outcome = run(all_but(before))?;
    let explained = explains(&outcome, before);
    if explained && !moved(&Told::of(&outcome)?, history) {
        return Ok((outcome, true, Done::Unchanged));
    }
    let outcome = run(Vec::new())?;
    let same = explained && explains(&outcome, before);
    Ok((outcome, same, Done::Searched))
}

/// True if a number of the log lies elsewhere than those of the logs before. Of as many numbers as there are the surest counts (Bonferroni).
fn moved(told: &Told, history: &[&Told]) -> bool {
    let mut before = BTreeMap::<String, Vec<Point>>::new();
    let point = |[value, sigma]: [f64; 2]| Point { day: 0.0, value, sigma };
    for (name, number, _) in history.iter().flat_map(|told| numbers(told)) {
        before.entry(name).or_default().push(point(number));
    }
    let p = |(name, number, _): (String, [f64; 2], String)| Some(p_value(&point(number), before.get(&name)?));
    let p: Vec<f64> = numbers(told).filter_map(p).collect();
    p.iter().any(|it| it * (p.len() as f64) < FALSE_ALARMS)
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
