//! `truing fleet check`: one task.

use crate::check::{Done, check};
use crate::manifest::Task;
use crate::moment::Moment;
use crate::store::Store;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `truing fleet check`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The model from which a search starts, TOML.
    #[arg(long)]
    model: PathBuf,
    /// The log.
    #[arg(long)]
    log: PathBuf,
    /// The motor's name: letters, digits, `.`, `_` and `-`.
    #[arg(long)]
    unit: String,
    /// When the log was taken: 2026-03-01 or 2026-03-01T08:30:00Z.
    #[arg(long)]
    at: Moment,
    /// Folder of the results.
    #[arg(long)]
    into: PathBuf,
}

/// Judges one log.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { model, log, unit, at, into } = arguments;
    let task = Task { unit: unit.clone(), at: *at, model: model.clone(), log: log.clone() };
    let done = check(&task, &Store::new(into))?;
    outln!("{}", told(&task, done));
    Ok(())
}

/// A line on a task that is done.
pub(super) fn told(task: &Task, done: Done) -> String {
    let how = match done {
        Done::There => "was done already",
        Done::Unchanged => "unchanged",
        Done::Searched => "searched",
    };
    format!("{} {} {how}", task.unit, task.at)
}
