//! Identification in ordinary motion, real loops around it: `cargo run -p evaluation -- passive --plants 30`.
//!
//! Prints two Markdown tables: learning where nothing was commissioned, and following a load step at constant speed after
//! a commissioning. Seeds apart from those that the identifier was designed with.

use evaluation::{Page, Results};
use rayon::prelude::*;
use servo::protect::Fault;
use std::collections::BTreeMap;
use trials::families::{Family, Seeds, Severity};
use trials::passive::{Followed, Following, Learned, Learning, Motion};
use trials::tracking::quantile;

/// Arguments.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Plants of each family a row.
    #[arg(long, default_value_t = 30)]
    plants: u32,
    /// Number of the first plant.
    #[arg(long, default_value_t = 0)]
    first: u32,
    /// Control rate, Hz.
    #[arg(long, default_value_t = 1_000)]
    tick: u32,
    /// Length of the motion that is learned from, s.
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Only motions whose name contains this.
    #[arg(long, default_value = "")]
    motion: String,
    /// Use the design seeds.
    #[arg(long)]
    design: bool,
    #[command(flatten)]
    results: Results,
}

/// Evaluation seeds of this suite start here.
const SEEDS: u32 = 740_000;
const FAMILIES: [Family; 3] = [Family::G1, Family::G2, Family::G3];

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    page.line(
        "| nothing commissioned | family | plants | dead zone % | gain % | time constant % | trusted, worst dead zone, gain, time constant | false trust | covered, u95 % | doubts | faults |"
    );
    page.line("|---|---|---|---|---|---|---|---|---|---|---|");
    for (name, motion) in [
        ("moves, as fast as planned", Motion::Moves),
        ("swings, peak 50 %", Motion::Swings(0.5)),
        ("swings, peak 25 %", Motion::Swings(0.25)),
        ("swings, peak 15 %", Motion::Swings(0.15)),
        ("swings, peak 10 %", Motion::Swings(0.1)),
    ] {
        if !name.contains(&arguments.motion) {
            continue;
        }
        let mut pooled = Vec::new();
        for family in FAMILIES {
            let runs = learn(&arguments, family, motion);
            learned(&mut page, name, &format!("{family:?}"), &runs);
            pooled.extend(runs);
        }
        learned(&mut page, name, "all", &pooled);
    }
    page.line("");
    page.line(
        "| load step 0.2 d at 30 % speed | plants | error before % | within 6 % after, s | error 15 s later % | other direction aged | faults |"
    );
    page.line("|---|---|---|---|---|---|---|");
    for family in FAMILIES {
        follow(&mut page, &arguments, family);
    }
    let (kind, offset) = if arguments.design { ("design", 0) } else { ("evaluation", SEEDS) };
    let first = offset + arguments.first;
    let last = first + arguments.plants.saturating_sub(1);
    page.close(&format!("{kind}, {first} to {last}"));
}

fn seeds(arguments: &Arguments) -> impl IndexedParallelIterator<Item = Seeds> {
    let range = arguments.first..arguments.first + arguments.plants;
    let design = arguments.design;
    range.into_par_iter().map(move |n| match design {
        true => Seeds::Design(n),
        false => Seeds::Evaluation(SEEDS + n),
    })
}

fn learn(arguments: &Arguments, family: Family, motion: Motion) -> Vec<Learned> {
    let learning = Learning {
        family,
        severity: Severity::Harsh,
        tick_hz: arguments.tick,
        motion,
        seconds: arguments.seconds,
    };
    seeds(arguments).map(|seed| learning.run(seed)).collect()
}

/// Median, 95th percentile and worst of magnitudes, in %.
fn spread(values: impl Iterator<Item = f64>) -> String {
    let found: Vec<f64> = values.filter(|x| x.is_finite()).map(|x| 100.0 * x.abs()).collect();
    let at = |p: f64| quantile(found.iter().copied(), p);
    format!("{:.2} / {:.2} / {:.1}", at(0.5), at(0.95), at(1.0))
}

fn learned(page: &mut Page, motion: &str, family: &str, runs: &[Learned]) {
    let numbers = || {
        runs.iter()
            .flat_map(|run| [0, 1].map(|side| (run.dead_zone[side], run.u95[side])))
            .filter(|(error, _)| error.is_finite())
    };
    let trusted: Vec<&Learned> = runs.iter().filter(|run| run.trusted).collect();
    let worst = |run: &Learned| run.dead_zone[0].abs().max(run.dead_zone[1].abs());
    let largest = |number: &dyn Fn(&Learned) -> f64| {
        100.0 * trusted.iter().map(|run| number(run).abs()).fold(0.0, f64::max)
    };
    let covered = numbers().filter(|(error, u95)| error.abs() <= *u95).count();
    let mut doubts = BTreeMap::new();
    for run in runs.iter().filter(|run| !run.trusted) {
        *doubts.entry(run.doubt.map_or("gain_or_time_constant", |reason| reason.code())).or_insert(0) += 1;
    }
    page.line(format_args!(
        "| {motion} | {family} | {} | {} | {} | {} | {:.0} %, {:.1}, {:.1}, {:.1} | {} | {:.1} %, {:.1} | {doubts:?} | {} |",
        runs.len(),
        spread(numbers().map(|(error, _)| error)),
        spread(runs.iter().map(|run| run.gain)),
        spread(runs.iter().map(|run| run.time_constant)),
        100.0 * trusted.len() as f64 / runs.len().max(1) as f64,
        largest(&worst),
        largest(&|run| run.gain),
        largest(&|run| run.time_constant),
        trusted.iter().filter(|run| worst(run) > 0.12).count(),
        100.0 * covered as f64 / numbers().count().max(1) as f64,
        100.0 * quantile(numbers().map(|(_, u95)| u95), 0.5),
        runs.iter().filter(|run| run.fault != Fault::None).count(),
    ));
}

fn follow(page: &mut Page, arguments: &Arguments, family: Family) {
    let following = Following {
        family,
        severity: Severity::Harsh,
        tick_hz: arguments.tick,
        speed_share: 0.3,
        load_share: 0.2,
    };
    let runs: Vec<Followed> = seeds(arguments).filter_map(|seed| following.run(seed).ok()).collect();
    let arrived = |p: f64| quantile(runs.iter().map(|run| run.within_6_percent_s), p);
    page.line(format_args!(
        "| {family:?} harsh | {} of {} | {} | {:.2} / {:.2} / {:.2} | {} | {} | {} |",
        runs.len(),
        arguments.plants,
        spread(runs.iter().map(|run| run.before)),
        arrived(0.5),
        arrived(0.95),
        arrived(1.0),
        spread(runs.iter().map(|run| run.after)),
        runs.iter().filter(|run| run.other_aged).count(),
        runs.iter().filter(|run| run.fault != Fault::None).count(),
    ));
}
