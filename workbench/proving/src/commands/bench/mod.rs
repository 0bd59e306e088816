//! `truing bench`: what a fixed set of searches costs, counted in simulations and steps, and in time and memory.

mod set;

use anyhow::ensure;
use clap::Args;
use derive_more::{Add, Sub};
use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeVal;
use serde::Serialize;
use set::Case;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::Instant;
use truing_core::system::plant::effort::{self, Work};
use truing_report::report::{grade, write_atomically};

/// Above the costs of the cases.
const HEAD: &str = "case                   simulations   inner steps        passes   CPU s  wall s  answer";
/// Arguments of `truing bench`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Number of drawn cases, of those whose seeds are fixed.
    #[arg(long, default_value_t = set::USUAL, value_parser = clap::value_parser!(u32).range(0..=set::MOST))]
    drawn: u32,
    /// Folder of rigs, each with model.toml, log.csv and holdout.csv or an expect.toml; they come besides those of data/rigs
    /// that take little time.
    #[arg(long)]
    data: Option<PathBuf>,
    /// Only cases with this text in their name (repeatable).
    #[arg(long, num_args = 1..)]
    only: Vec<String>,
    /// Write the figures as JSON; `-` is standard output, where nothing else is then printed.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// What was measured.
#[derive(Default, Serialize)]
struct Figures {
    /// `truing-bench/1`.
    schema: &'static str,
    cases: Vec<Measured>,
    total: Cost,
    /// Largest memory of the process, bytes.
    peak_bytes: Option<u64>,
}

#[derive(Serialize)]
struct Measured {
    case: String,
    verdict: &'static str,
    names: Vec<String>,
    #[serde(flatten)]
    cost: Cost,
}

/// What one or several searches cost.
#[derive(Clone, Copy, Default, Add, Sub, Serialize)]
struct Cost {
    /// What was computed.
    #[serde(flatten)]
    work: Work,
    /// CPU time of all threads, s; 0 where the system does not tell.
    cpu_s: f64,
    /// Time that passed, s.
    wall_s: f64,
}

impl Cost {
    /// By this process.
    fn so_far() -> Self {
        static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
        let cpu_s = getrusage(UsageWho::RUSAGE_SELF).map_or(0.0, |usage| {
            let seconds = |time: TimeVal| time.tv_sec() as f64 + 1e-6 * time.tv_usec() as f64;
            seconds(usage.user_time()) + seconds(usage.system_time())
        });
        Self { work: effort::done(), cpu_s, wall_s: BEGIN.elapsed().as_secs_f64() }
    }

    fn line(&self, name: &str, answer: &str) -> String {
        let Self { work: Work { simulations, inner_steps, passes }, cpu_s, wall_s } = self;
        format!(
            "{name:22} {simulations:>11} {inner_steps:>13} {passes:>13} {cpu_s:>7.2} {wall_s:>7.2}  {answer}"
        )
    }
}

/// Runs the cases one after the other.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut cases = set::cases(arguments.drawn, arguments.data.as_deref())?;
    if !arguments.only.is_empty() {
        cases.retain(|case| arguments.only.iter().any(|text| case.name().contains(text)));
    }
    ensure!(!cases.is_empty(), "--only {}: no case has that in its name", arguments.only.join(" "));
    let silent = arguments.json.as_deref() == Some("-".as_ref());
    if !silent {
        outln!("{HEAD}");
    }
    let mut figures = Figures { schema: "truing-bench/1", ..Figures::default() };
    for (place, case) in cases.iter().enumerate() {
        errln!("{} of {}: {}", place + 1, cases.len(), case.name());
        let Some(measured) = measured(case, arguments.data.as_deref())? else {
            errln!("{}: skipped, its data are absent", case.name());
            continue;
        };
        if !silent {
            outln!("{}", measured.line());
        }
        figures.cases.push(measured);
    }
    figures.total = figures.cases.iter().fold(Cost::default(), |sum, one| sum + one.cost);
    figures.peak_bytes = peak_bytes();
    figures.tell(arguments, silent)
}

/// Runs a case; `None` if its data are absent. Drawing it is not counted.
fn measured(case: &Case, data: Option<&Path>) -> anyhow::Result<Option<Measured>> {
    let ready = case.made_ready()?;
    let before = Cost::so_far();
    let Some(outcome) = ready.answer(data)? else {
        return Ok(None);
    };
    let cost = Cost::so_far() - before;
    let names = outcome.effects.iter().map(|effect| effect.name.clone()).collect();
    Ok(Some(Measured { case: case.name(), verdict: grade(&outcome), names, cost }))
}

impl Measured {
    fn line(&self) -> String {
        let names =
            if self.names.is_empty() { String::new() } else { format!(": {}", self.names.join(" + ")) };
        self.cost.line(&self.case, &format!("{}{names}", self.verdict))
    }
}

impl Figures {
    fn tell(&self, arguments: &Arguments, silent: bool) -> anyhow::Result<()> {
        let json = || serde_json::to_string_pretty(self).map(|text| text + "\n");
        if silent {
            out!("{}", json()?);
            return Ok(());
        }
        outln!("{}", self.total.line(&format!("{} cases", self.cases.len()), ""));
        let threads = rayon::current_num_threads();
        let peak =
            self.peak_bytes.map_or("not told here".into(), |bytes| format!("{:.1} MB", 1e-6 * bytes as f64));
        outln!("peak memory {peak}, {threads} threads; counts do not depend on the number of threads");
        match &arguments.json {
            Some(path) => write_atomically(path, &json()?),
            None => Ok(()),
        }
    }
}

/// Largest memory of this process so far; `None` where the system does not tell.
fn peak_bytes() -> Option<u64> {
    let most = getrusage(UsageWho::RUSAGE_SELF).ok()?.max_rss();
    // Linux tells kilobytes, macOS bytes.
    let unit = if cfg!(target_os = "macos") { 1 } else { 1024 };
    u64::try_from(most).ok().filter(|most| *most > 0).map(|most| most * unit)
}
