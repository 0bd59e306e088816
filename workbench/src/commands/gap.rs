//! `truing gap`: where do model and log disagree, and what is missing?

use crate::gap;
use crate::log::{self, Columns, Dynamic, Log};
use crate::model;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `truing gap`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The model, TOML.
    #[arg(long)]
    pub model: PathBuf,
    /// The log, CSV: a record over time, or a table of steady states.
    #[arg(long)]
    pub log: PathBuf,
    /// Further logs that are not fitted, only predicted.
    #[arg(long, num_args = 1..)]
    pub holdout: Vec<PathBuf>,
    /// Foreign column names: `u_v=u_V,omega_rad_s=left_rpm*0.104720`; `t_s=none` ignores the time (a steady-state table).
    #[arg(long, default_value = "")]
    pub columns: String,
    /// Folder for report.html, outcome.json and the extended model.toml.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Write the result as JSON.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write the report as one HTML file.
    #[arg(long)]
    pub report: Option<PathBuf>,
}

/// Reads, analyses, reports.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let columns: Columns = arguments.columns.parse()?;
    let model = model::read(&arguments.model)?;
    let log = log::read(&arguments.log, &columns)?;
    let holdouts: Vec<Log> = arguments
        .holdout
        .iter()
        .map(|path| log::read(path, &columns))
        .collect::<Result<_, _>>()?;
    let outcome = match log {
        Log::Table(_) => anyhow::bail!("steady-state tables are not analysed yet"),
        Log::Dynamic(log) => {
            let holdouts = dynamic(holdouts)?;
            gap::run(&model, &log, &holdouts, &gap::Options::default(), &|_| {})?
        }
    };
    println!("{}", serde_json::to_string_pretty(&outcome)?);
    Ok(())
}

fn dynamic(logs: Vec<Log>) -> anyhow::Result<Vec<Dynamic>> {
    let one = |log| match log {
        Log::Dynamic(log) => Ok(log),
        Log::Table(table) => anyhow::bail!(
            "{}: is a steady-state table, but the log is a record over time",
            table.source
        ),
    };
    logs.into_iter().map(one).collect()
}
