//! The tracking and hunting suite: `cargo run -p evaluation -- tracking --plants 200`.
//!
//! Prints one Markdown table: every row an experiment on as many plants as asked for, seeds apart from those that the
//! loops were designed with.

use evaluation::{Page, Results};
use rayon::prelude::*;
use servo::axis::HOLD_BAND;
use servo::control::Tuning;
use servo::protect::Fault;
use trials::families::{Family, Seeds, Severity};
use trials::tracking::{Experiment, Knowledge, Left, Run, quantile};

/// Arguments.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Plants a row.
    #[arg(long, default_value_t = 200)]
    plants: u32,
    /// Number of the first plant.
    #[arg(long, default_value_t = 0)]
    first: u32,
    /// Families: G1, G2, G3, paper.
    #[arg(long, value_delimiter = ',', default_value = "G1,G2,G3,paper")]
    family: Vec<String>,
    /// Control rates, Hz. The paper's slow motor runs at 1,000 alone.
    #[arg(long, value_delimiter = ',', default_value = "1000,10000")]
    tick: Vec<u32>,
    #[command(flatten)]
    results: Results,
}

const FAMILIES: [(&str, Family, Severity); 4] = [
    ("G1 harsh", Family::G1, Severity::Harsh),
    ("G2 harsh", Family::G2, Severity::Harsh),
    ("G3 harsh", Family::G3, Severity::Harsh),
    ("paper ± 20 %", Family::Paper, Severity::Nominal),
];

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    page.line(
        "| plants | tick | sine | knowledge | trusted | rms without | rms with, median / p95 | better, median / p10 / worst | speed estimate | left the hold band | sign changes outside it | rests outside it, farthest | faults |"
    );
    page.line("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (name, family, severity) in FAMILIES {
        if !arguments.family.iter().any(|wanted| name.starts_with(wanted.as_str())) {
            continue;
        }
        for &tick_hz in &arguments.tick {
            if family == Family::Paper && tick_hz > 1_000 {
                continue;
            }
            for experiment in experiments(family, severity, tick_hz) {
                row(&mut page, name, &experiment, &arguments);
            }
        }
    }
    let last = arguments.first + arguments.plants.saturating_sub(1);
    page.close(&format!("evaluation, {} to {last}", arguments.first));
}

/// Both speeds, with the chip's own estimates and with the true ones.
fn experiments(family: Family, severity: Severity, tick_hz: u32) -> Vec<Experiment> {
    let slow = family == Family::Paper;
    let budget_ms = if slow { 20_000 } else { 5_000 };
    let mut all = Vec::new();
    for (speed_share, hz) in [(0.2, 1.0), (0.05, 0.5)] {
        for knowledge in [Knowledge::Identified(budget_ms), Knowledge::Exact] {
            all.push(Experiment {
                family,
                severity,
                tick_hz,
                speed_share,
                frequency_hz: if slow { 0.05 } else { hz },
                tuning: Tuning::default(),
                knowledge,
            });
        }
    }
    all
}

fn row(page: &mut Page, name: &str, experiment: &Experiment, arguments: &Arguments) {
    let all: Vec<Result<Run, Left>> = (arguments.first..arguments.first + arguments.plants)
        .into_par_iter()
        .map(|n| experiment.run(Seeds::Evaluation(n)))
        .collect();
    let runs: Vec<&Run> = all.iter().flatten().collect();
    let percent = |p: f64, f: &dyn Fn(&Run) -> f64| 100.0 * quantile(runs.iter().map(|run| f(run)), p);
    let better = |p: f64| quantile(runs.iter().map(|run| run.rms[0] / run.rms[1]), p);
    let share = |f: &dyn Fn(&Run) -> bool| {
        100.0 * runs.iter().filter(|run| f(run)).count() as f64 / runs.len().max(1) as f64
    };
    page.line(format_args!(
        "| {name} | {} kHz | {:.0} % at {} Hz | {} | {:.0} % | {:.1} % | {:.2} / {:.2} % | {:.1} / {:.1} / {:.1} | {:.1} % | {:.1} % | {:.1} % | {:.1} %, {} counts | {} |",
        experiment.tick_hz / 1000,
        100.0 * experiment.speed_share,
        experiment.frequency_hz,
        if experiment.knowledge == Knowledge::Exact {
            "true"
        } else {
            "identified"
        },
        100.0 * runs.len() as f64 / all.len() as f64,
        percent(0.5, &|run| run.rms[0]),
        percent(0.5, &|run| run.rms[1]),
        percent(0.95, &|run| run.rms[1]),
        better(0.5),
        better(0.1),
        better(0.0),
        percent(0.5, &|run| run.speed_estimate),
        share(&|run| run.escapes > 0),
        share(&|run| run.sign_changes > 0),
        share(&|run| run.final_error.abs() > HOLD_BAND),
        runs.iter().map(|run| run.final_error.abs()).max().unwrap_or(0),
        runs.iter().filter(|run| run.fault != Fault::None).count(),
    ));
}
