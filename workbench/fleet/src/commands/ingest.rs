//! `truing fleet ingest`: all tasks of a manifest.

use super::check::told;
use crate::store::Store;
use crate::{ingest, manifest};
use clap::Args;
use std::path::PathBuf;
use truing_core::text::input_error::InputError;

/// Arguments of `truing fleet ingest`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// CSV with the columns unit, time, model, log. Relative paths start at its folder.
    manifest: PathBuf,
    /// Folder of the results.
    #[arg(long)]
    into: PathBuf,
    /// Logs at once; 0: as many as there are cores.
    #[arg(long, default_value_t = 0)]
    workers: usize,
}

/// Judges all logs.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let units = manifest::read(&arguments.manifest)?;
    let say = |task: &manifest::Task, done| errln!("{}", told(task, done));
    let summary = ingest::run(&units, &Store::new(&arguments.into), arguments.workers, &say)?;
    outln!(
        "{} results in {}: {} were there, {} unchanged, {} searched, {} failed",
        summary.there + summary.written(),
        arguments.into.display(),
        summary.there,
        summary.unchanged,
        summary.searched,
        summary.failed.len()
    );
    InputError::all(summary.failed.into_iter().map(InputError).collect())?;
    Ok(())
}
