//! `truing bench`: what a fixed set of searches costs, counted in simulations and steps, and in time and memory.

mod instructions;
mod set;

use anyhow::ensure;
use clap::Args;
use instructions::Instructions;
use nix::sys::resource::{UsageWho, getrusage};
use serde::Serialize;
use set::Case;
use std::path::PathBuf;
use truing_core::gap::effort::{self, Phase, Spent, Work};
use truing_report::report::{grade, write_atomically};

/// Above the costs of the cases.
const HEAD: &str =
    "case                   simulations   inner steps        passes   instructions   CPU s  wall s  answer";
/// Above those of the phases.
const PHASES: &str =
    "phase                  simulations   inner steps      %        passes      %   CPU s      %  wall s";

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
    /// Print what each phase of the searches costs.
    #[arg(long)]
    phases: bool,
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
    phases: Vec<OfPhase>,
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

/// What one or several searches took.
#[derive(Clone, Copy, Default, Serialize)]
struct Cost {
    #[serde(flatten)]
    spent: Spent,
    /// Instructions of all threads, where processor and system count them.
    instructions: Option<u64>,
}

#[derive(Serialize)]
struct OfPhase {
    phase: &'static str,
    #[serde(flatten)]
    spent: Spent,
}

/// Runs the cases one after the other.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut cases = set::cases(arguments.drawn, arguments.data.as_deref())?;
    if !arguments.only.is_empty() {
        cases.retain(|case| arguments.only.iter().any(|text| case.name().contains(text)));
    }
    ensure!(!cases.is_empty(), "--only {}: no case has that in its name", arguments.only.join(" "));
    let silent = arguments.json.as_deref() == Some("-".as_ref());
    let counter = Instructions::begin();
    if !silent {
        outln!("{HEAD}");
    }
    let mut figures = Figures { schema: "truing-bench/1", ..Figures::default() };
    let mut phases = [Spent::default(); Phase::ALL.len()];
    for (place, case) in cases.iter().enumerate() {
        errln!("{} of {}: {}", place + 1, cases.len(), case.name());
        let Some(measured) = measured(case, arguments, &counter, &mut phases)? else {
            errln!("{}: skipped, its data are absent", case.name());
            continue;
        };
        if !silent {
            outln!("{}", measured.line());
        }
        figures.cases.push(measured);
    }
    figures.total = figures.cases.iter().fold(Cost::default(), |sum, one| sum.plus(&one.cost));
    figures.phases =
        Phase::ALL.iter().zip(phases).map(|(phase, spent)| OfPhase { phase: phase.words(), spent }).collect();
    figures.peak_bytes = peak_bytes();
    figures.tell(arguments, silent)
}

/// Runs a case; `None` if its data are absent. Drawing it is not counted.
fn measured(
    case: &Case,
    arguments: &Arguments,
    counter: &Instructions,
    phases: &mut [Spent; Phase::ALL.len()],
) -> anyhow::Result<Option<Measured>> {
    let ready = case.made_ready()?;
    let (before, instructions) = (effort::spent(), counter.read());
    let Some(outcome) = ready.answer(arguments.data.as_deref())? else {
        return Ok(None);
    };
    let mut cost = Cost {
        instructions: counter.read().zip(instructions).map(|(now, then)| now - then),
        ..Cost::default()
    };
    for (sum, (now, then)) in phases.iter_mut().zip(effort::spent().into_iter().zip(before)) {
        let spent = now - then;
        *sum = *sum + spent;
        cost.spent = cost.spent + spent;
    }
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

impl Cost {
    fn plus(&self, other: &Self) -> Self {
        Self {
            spent: self.spent + other.spent,
            instructions: match (self.instructions, other.instructions) {
                (Some(one), Some(another)) => Some(one + another),
                (one, another) => one.or(another),
            },
        }
    }

    fn line(&self, name: &str, answer: &str) -> String {
        let instructions = self.instructions.map_or("not here".into(), |count| count.to_string());
        let Spent { work: Work { simulations, inner_steps, passes }, cpu_s, wall_s } = self.spent;
        format!(
            "{name:22} {simulations:>11} {inner_steps:>13} {passes:>13} {instructions:>14} {cpu_s:>7.2} {wall_s:>7.2}  {answer}"
        )
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
        if self.total.instructions.is_none() {
            outln!("instructions are not counted here: this system offers no hardware counter");
        }
        if arguments.phases {
            self.tell_phases();
        }
        match &arguments.json {
            Some(path) => write_atomically(path, &json()?),
            None => Ok(()),
        }
    }

    fn tell_phases(&self) {
        let share = |part: f64, whole: f64| 100.0 * part / whole.max(f64::MIN_POSITIVE);
        outln!("\n{PHASES}");
        for OfPhase { phase, spent: Spent { work, cpu_s, wall_s } } in &self.phases {
            let (all, Work { simulations, inner_steps, passes }) = (self.total.spent.work, *work);
            let steps = share(inner_steps as f64, all.inner_steps as f64);
            let passed = share(passes as f64, all.passes as f64);
            let cpu = share(*cpu_s, self.total.spent.cpu_s);
            outln!(
                "{phase:22} {simulations:>11} {inner_steps:>13} {steps:>6.1} {passes:>13} {passed:>6.1} {cpu_s:>7.2} {cpu:>6.1} {wall_s:>7.2}"
            );
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
