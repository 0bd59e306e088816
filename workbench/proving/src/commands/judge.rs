//! `truing judge`: are the answers on rigs whose effects are known right?

use crate::commands::rig::Rig;
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;
use truing_core::gap::{Options, completed};
use truing_core::outcome::Outcome;
use truing_core::text::input_error::NotDone;
use truing_files::log::{self, Columns, Dynamic, Log};
use truing_files::model;
use truing_report::console::watched::watched;
use truing_report::report::Exporter;
use truing_report::report::json::Json;

/// Above the answers.
const HEAD: &str =
    "rig                    verdict                      before  after wanted   best  left     s  names";

/// Arguments of `truing judge`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// A folder of rigs, or one rig: a folder with model.toml, log.csv, holdout.csv and expect.toml.
    pub folder: PathBuf,
    /// Folder of measured data in which files that a rig's folder does not hold are looked for.
    #[arg(long)]
    pub data: Option<PathBuf>,
    /// Only rigs with this text in their name (repeatable).
    #[arg(long, num_args = 1..)]
    pub only: Vec<String>,
    /// Folder for the JSON result of each rig.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// How a rig came out.
enum Judged {
    Accepted,
    KnownShortfall,
    Wrong,
    Skipped,
}

/// Judges the rigs of a folder. An error if one is wrong that is not known to fall short.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut rigs = Rig::all(&arguments.folder)?;
    if !arguments.only.is_empty() {
        rigs.retain(|rig| arguments.only.iter().any(|text| rig.name.contains(text)));
    }
    outln!("{HEAD}");
    let mut counts = [0; 4];
    for rig in &rigs {
        let judged = judged(rig, arguments)?;
        counts[judged as usize] += 1;
    }
    let [accepted, known, wrong, skipped] = counts;
    outln!(
        "{accepted} of {} rigs accepted, {known} known to fall short, {wrong} wrong, {skipped} skipped for want of their data",
        rigs.len() - skipped
    );
    if wrong > 0 {
        return Err(NotDone(format!("{wrong} of the rigs above are not answered as expected")).into());
    }
    Ok(())
}

fn judged(rig: &Rig, arguments: &Arguments) -> anyhow::Result<Judged> {
    let started = Instant::now();
    let Some(outcome) = answer(rig, arguments.data.as_deref(), &Options::default())? else {
        outln!("{:22} skipped: its data are absent", rig.name);
        return Ok(Judged::Skipped);
    };
    let seconds = started.elapsed().as_secs_f64();
    if let Some(folder) = &arguments.out {
        std::fs::create_dir_all(folder)?;
        Json.write(&outcome, &folder.join(format!("{}.json", rig.name)))?;
    }
    let (held, expected) = (&outcome.holdout, &rig.expectation);
    let names: Vec<&str> = outcome.effects.iter().map(|effect| effect.name.as_str()).collect();
    outln!(
        "{:22} {:28} {:6.1} {:6.1} {:6.1} {:6.1} {:4.0}% {seconds:5.1}  {}",
        rig.name,
        truing_report::report::grade(&outcome),
        held.fit_percent_before,
        held.fit_percent_after,
        expected.fit_percent,
        expected.best_known_percent,
        100.0 * outcome.unexplained.share_of_gap,
        if names.is_empty() { "–".to_owned() } else { names.join(" + ") }
    );
    let faults = expected.faults(&outcome);
    for fault in &faults {
        outln!("{:22} {fault}", "");
    }
    Ok(match (faults.is_empty(), &expected.shortfall) {
        (true, _) => Judged::Accepted,
        (false, Some(reason)) => {
            outln!("{:22} known: {reason}", "");
            Judged::KnownShortfall
        }
        (false, None) => Judged::Wrong,
    })
}

/// The answer of the gap workflow; `None` if the rig's data are absent.
pub fn answer(rig: &Rig, data: Option<&Path>, options: &Options) -> anyhow::Result<Option<Outcome>> {
    let expected = &rig.expectation;
    let file = |relative: &PathBuf| rig.file(relative, data);
    let holdouts = if expected.halves { &[][..] } else { &expected.holdout[..] };
    let holdouts: Option<Vec<PathBuf>> = holdouts.iter().map(file).collect();
    let (Some(model), Some(log), Some(holdouts)) = (file(&expected.model), file(&expected.log), holdouts)
    else {
        return Ok(None);
    };
    let draft = model::read_draft(&model)?;
    let columns = Columns::of(&expected.columns, draft.stated())?;
    let mut log = log::read(&log, &columns)?;
    let read = |path: &PathBuf| log::read(path, &columns);
    let mut holdouts: Vec<Log> = holdouts.iter().map(read).collect::<Result<_, _>>()?;
    if let (true, Log::Dynamic(whole)) = (expected.halves, &log) {
        let (first, second) = halves(whole);
        holdouts = vec![Log::Dynamic(second)];
        log = Log::Dynamic(first);
    }
    let model = completed(draft, &log)?;
    Ok(Some(watched(&model, &log, &holdouts, options)?))
}

/// First and second half of the first run of a record.
fn halves(log: &Dynamic) -> (Dynamic, Dynamic) {
    let run = &log.runs[0];
    let half = |from: usize, to: usize, part: &str| Dynamic {
        source: format!("{}, {part} half", log.source),
        runs: vec![run.rows_between(from, to, 0)],
        ..log.clone()
    };
    let middle = run.rows() / 2;
    (half(0, middle, "first"), half(middle, run.rows(), "second"))
}
