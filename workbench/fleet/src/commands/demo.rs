//! `truing fleet demo`: a small drawn fleet from its logs to its page.

use super::report;
use crate::findings::RATE;
use crate::generator::{Fate, Fleet};
use crate::stats::spread::Method;
use crate::store::Store;
use crate::{ingest, manifest};
use anyhow::Result;
use clap::Args;
use std::path::PathBuf;
use truing_core::text::input_error::InputError;

/// Units, days and rows: some hundred quick logs, two minutes on two cores.
const UNITS: u32 = 8;
const DAYS: u32 = 12;
const ROWS: usize = 900;
/// Part by which a friction drifts or steps.
const CHANGE: f64 = 0.3;
/// The day (from 0) on which a friction steps and an effect appears.
const DAY: u32 = 6;

/// Arguments of `truing fleet demo`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Folder for manifest, logs, results and page.
    #[arg(long, default_value = "target/fleet-demo")]
    out: PathBuf,
    /// Draws the fleet.
    #[arg(long, default_value_t = 1)]
    seed: u32,
}

/// Draws, judges, reports.
pub fn run(arguments: &Arguments) -> Result<()> {
    let out = &arguments.out;
    let fleet = Fleet::draw(arguments.seed, DAYS, ROWS);
    let fates = fates(&fleet);
    for (unit, fate) in (1..).zip(&fates).filter(|(_, fate)| **fate != Fate::Quiet) {
        outln!("unit {unit:03} {}", said(fate));
    }
    fleet.write(out, &fates)?;
    let results = out.join("results");
    let summary =
        ingest::run(&manifest::read(&out.join("manifest.csv"))?, &Store::new(&results), 0, &|_, _| ())?;
    InputError::all(summary.failed.iter().cloned().map(InputError).collect())?;
    outln!("{} unchanged, {} searched, {} were there", summary.unchanged, summary.searched, summary.there);
    let (page, json) = (out.join("fleet.html"), out.join("fleet.json"));
    report::tell(&report::write(&results, [Some(&page), Some(&json)], (Method::default(), RATE))?);
    outln!("The page: {}", page.display());
    Ok(())
}

fn fates(fleet: &Fleet) -> Vec<Fate> {
    let fate = |unit| match unit {
        2 => Fate::Drifts(CHANGE),
        4 => Fate::Steps(CHANGE, DAY),
        6 => fleet.new_effect(unit, DAY),
        _ => Fate::Quiet,
    };
    (1..=UNITS).map(fate).collect()
}

/// What was drawn, in words that follow the unit.
fn said(fate: &Fate) -> String {
    match fate {
        Fate::Quiet => "stays as it is".into(),
        Fate::Drifts(part) => format!("drifts: its friction grows by {:.0} % in {DAYS} days", 100.0 * part),
        Fate::Steps(part, day) => format!("steps: its friction grows by {:.0} % on day {day}", 100.0 * part),
        Fate::Gets(effect, _, day) => format!("gets {} on day {day}", effect.name),
    }
}
