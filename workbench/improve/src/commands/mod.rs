//! One file a subcommand, or several that share their work.

pub mod improve;
pub mod record;

use crate::history;
use clap::Subcommand;
use std::path::PathBuf;

/// The subcommands of the loop.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Move a servo so that its log tells effects apart, within its limits.
    Record(record::Arguments),
    /// Improve how a servo follows: record, name, compensate, measure again, keep or roll back.
    Improve(improve::Improve),
    /// List what `truing improve` has tried.
    History {
        /// The folder that `truing improve --out` has written.
        folder: PathBuf,
    },
    /// Bring back what was in force before an improvement.
    Undo(improve::Undo),
}

impl Command {
    /// Runs the chosen one. An error is one sentence for the user.
    pub fn run(&self) -> anyhow::Result<()> {
        match self {
            Command::Record(arguments) => record::run(arguments)?,
            Command::Improve(arguments) => improve::improve(arguments)?,
            Command::History { folder } => out!("{}", history::text(&history::read(folder)?)),
            Command::Undo(arguments) => improve::undo(arguments)?,
        }
        Ok(())
    }
}
