//! The gap workflow as a library: read a model and a log, name what the model is missing, print the verdict.
//!
//! ```text
//! cargo run -p truing --example name_what_is_missing -- MODEL.toml LOG.csv [HOLDOUT.csv]
//! ```

use std::path::Path;
use truing::files::log::{self, Columns, Dynamic, Log};
use truing::files::model;
use truing::gap::{self, Options};
use truing::outcome::Outcome;
use truing::report;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, log, holdouts @ ..] = &arguments[..] else { anyhow::bail!("give a model and a log") };
    let model = model::read(Path::new(model))?;
    let log = record(log)?;
    let holdouts = holdouts.iter().map(|path| record(path)).collect::<Result<Vec<_>, _>>()?;
    let outcome = gap::run(&model, &log, &holdouts, &Options::default(), &|_| {})?;
    print(&outcome);
    Ok(())
}

/// A record over time. The columns are found by their names.
fn record(path: &str) -> anyhow::Result<Dynamic> {
    match log::read(Path::new(path), &Columns::default())? {
        Log::Dynamic(record) => Ok(record),
        Log::Table(_) => anyhow::bail!("{path} has no time column"),
    }
}

fn print(outcome: &Outcome) {
    println!("{}", report::verdict(outcome.verdict));
    for effect in &outcome.effects {
        println!("{}: the gap falls from {:.3} to {:.3}", effect.name, effect.gap_before, effect.gap_after);
    }
    let held = &outcome.holdout;
    println!("fit on held-out data: {:.1} % -> {:.1} %", held.fit_percent_before, held.fit_percent_after);
}
