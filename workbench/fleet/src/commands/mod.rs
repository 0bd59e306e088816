//! `truing fleet`: many logs of many motors.

mod check;
mod demo;
mod ingest;
mod report;

use clap::{Args, Subcommand};

/// Below `--help`.
const EXAMPLES: &str = "\
Examples:
  All logs of a list, with rows `unit,time,model,log`; again after a kill, it goes on:
      truing fleet ingest manifest.csv --into results
  One log of it, as another machine would:
      truing fleet check --model sheet.toml --log x.csv --unit 17 --at 2026-03-01 --into results
  Spread, drifts, steps and new effects:
      truing fleet report results --out fleet.html
Page: docs/fleets.md";

/// Arguments of `truing fleet`.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Judge one log against what its unit was before; one result file.
    Check(check::Arguments),
    /// Judge all logs of a manifest on this machine; what is done already is not done again.
    Ingest(ingest::Arguments),
    /// Tell how units differ, what drifts and steps, and which effects are new.
    Report(report::Arguments),
    /// Draw a small fleet, run it, and write its page.
    Demo(demo::Arguments),
}

/// Runs the chosen command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    match &arguments.command {
        Command::Check(arguments) => check::run(arguments),
        Command::Ingest(arguments) => ingest::run(arguments),
        Command::Report(arguments) => report::run(arguments),
        Command::Demo(arguments) => demo::run(arguments),
    }
}
