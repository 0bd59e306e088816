//! `truing fleet report`: what the results come to.

use crate::appeared::Appeared;
use crate::findings::{Changed, Findings, RATE};
use crate::page::page;
use crate::stats::spread::Method;
use crate::store::Store;
use anyhow::{Result, ensure};
use clap::Args;
use std::path::{Path, PathBuf};
use truing_report::report::write_atomically;

/// Arguments of `truing fleet report`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Folder of the results.
    folder: PathBuf,
    /// Write the page, HTML; `-` is standard output.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write the findings as JSON; `-` is standard output.
    #[arg(long)]
    json: Option<PathBuf>,
    /// How the spread between units is estimated.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    /// The share of false ones that is allowed among the drifts and steps that are told, above 0 and below 1.
    #[arg(long, default_value_t = RATE)]
    rate: f64,
}

/// Reads, counts, reports.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { folder, rate, .. } = arguments;
    ensure!(*rate > 0.0 && *rate < 1.0, "--rate {rate}: write a share above 0 and below 1, e.g. 0.05");
    let paths = [arguments.out.as_deref(), arguments.json.as_deref()];
    let findings = write(folder, paths, (arguments.method, *rate))?;
    if paths.into_iter().flatten().all(|path| path != Path::new("-")) {
        tell(&findings);
    }
    Ok(())
}

/// Writes the page and the JSON of a folder.
pub(super) fn write(folder: &Path, paths: [Option<&Path>; 2], how: (Method, f64)) -> Result<Findings> {
    let ([out, json], told, fleet) = (paths, folder.display(), Store::new(folder).all()?);
    ensure!(!fleet.is_empty(), "{told}: holds no results; run `truing fleet ingest` into it first");
    let findings = Findings::of(&fleet, how.0, how.1);
    if let Some(path) = json {
        write_atomically(path, &(serde_json::to_string_pretty(&findings)? + "\n"))?;
    }
    if let Some(path) = out {
        page(&fleet, &findings, &format!("truing fleet report {told}")).write(path)?;
    }
    Ok(findings)
}

/// A line for each finding.
pub(super) fn tell(findings: &Findings) {
    outln!("{} units, {} logs, {} of them not judged", findings.units, findings.logs, findings.not_judged);
    for it in &findings.appeared {
        let sure = if it.confirmed { "" } else { ", not confirmed" };
        let (Appeared { unit, effect, at, of_logs, .. }, shown) = (it, it.logs.len());
        outln!("unit {unit}: {effect} since {at} ({shown} of {of_logs} logs{sure})");
    }
    for it in &findings.changed {
        let kind = format!("{:?}", it.kind).to_lowercase();
        let Changed { unit, quantity, of, at, change, sigma, q, .. } = it;
        outln!("unit {unit}: {kind} of {quantity}, {change:+.3e} ± {sigma:.1e} {of} since {at}, q = {q:.1e}");
    }
}
