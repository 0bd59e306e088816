//! Evaluation of fleets: `cargo run -p evaluation -- fleet`.
//!
//! Two parts. The statistics are measured on many fleets of drawn results whose errors are what they are said to be. Names, alarms and spread
//! are measured end to end besides, on fewer fleets: drawn motors, logs of them, a check each.

use evaluation::{Page, Results};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use truing::fleet::findings::{Changed, Findings, RATE};
use truing::fleet::generator::{Fate, Fleet};
use truing::fleet::ingest::{self, Summary};
use truing::fleet::manifest;
use truing::fleet::moment::Moment;
use truing::fleet::stats::spread::Method;
use truing::fleet::store::{Effect, Kept, Key, Number, Store, Told};
use truing::system::effects;

#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Drawn fleets of results.
    #[arg(long, default_value_t = 40)]
    fleets: u64,
    /// Units of each.
    #[arg(long, default_value_t = 200)]
    units: u32,
    /// Days, a log each.
    #[arg(long, default_value_t = 20)]
    days: u32,
    /// Kinds of motor that are drawn end to end, each a fleet of as many units and days.
    #[arg(long, default_value_t = 1)]
    kinds: u32,
    /// Rows of an end-to-end log.
    #[arg(long, default_value_t = 900)]
    rows: usize,
    /// First seed.
    #[arg(long, default_value_t = 1)]
    first: u32,
    /// Folder of the end-to-end logs and results: what is there is not done again.
    #[arg(long, default_value = "target/fleet-evaluation")]
    folder: PathBuf,
    #[command(flatten)]
    results: Results,
}

/// Numbers of a drawn unit: one of an effect, three of the model file.
const NUMBERS: [&str; 4] = ["coulomb_friction.level_nm", "R_ohm", "K_nm_per_a", "J_kgm2"];
/// One standard deviation of a drawn number; that between units is twice it.
const SIGMA: f64 = 1.0;
const BETWEEN: f64 = 2.0;
/// Of ten units one drifts, one steps, and three get an effect. From the day on that is this part of all.
const MIDDLE: f64 = 0.6;
/// Drifts and steps, in standard deviations by which the friction of a unit scatters from log to log.
const SIZE: f64 = 3.0;

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    quiet(&arguments, &mut page);
    for (part, size) in [(0.1, 3.0), (0.25, 3.0), (0.1, 4.0), (0.1, 5.0)] {
        changing(&arguments, &mut page, part, size);
    }
    if arguments.kinds > 0 {
        end_to_end(&arguments, &mut page);
    }
    let (first, fleets) = (u64::from(arguments.first), arguments.fleets);
    page.close(&format!(
        "fleets {first} to {}, kinds {first} to {}",
        first + fleets - 1,
        arguments.first + arguments.kinds
    ));
}

/// What becomes of a number of a drawn unit, in standard deviations of one log.
#[derive(Clone, Copy, PartialEq)]
enum Change {
    Quiet,
    Drift(f64),
    Step(f64),
}

/// The results of a unit, as a store would hand them out. The change is in number `unit % 4`.
fn unit(rng: &mut ChaCha8Rng, unit: u32, days: u32, change: Change) -> (String, Vec<Kept>) {
    let first: Moment = "2026-03-01".parse().expect("a date");
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    let levels: [f64; 4] = std::array::from_fn(|_| 10.0 + BETWEEN * normal());
    let step = 5 + unit % (days - 10);
    let name = format!("{unit:04}");
    let kept = |day: u32| {
        // Logs are not equally good: their sigmas differ by half.
        let sigmas: [f64; 4] = std::array::from_fn(|_| SIGMA * (0.4 * normal()).exp());
        let values: [f64; 4] = std::array::from_fn(|k| {
            let moved = match change {
                _ if k != (unit % 4) as usize => 0.0,
                Change::Quiet => 0.0,
                Change::Drift(size) => size * SIGMA * f64::from(day) / f64::from(days - 1),
                Change::Step(size) => size * SIGMA * f64::from(u8::from(day >= step)),
            };
            levels[k] + moved + sigmas[k] * normal()
        });
        result(&name, first + day, values, sigmas)
    };
    let results = (0..days).map(kept).collect();
    (name, results)
}

fn result(unit: &str, at: Moment, values: [f64; 4], sigmas: [f64; 4]) -> Kept {
    let number = |k: usize| Number { value: Some(values[k]), std: Some(sigmas[k]), unit: "N m".into() };
    let effect = |k: usize| {
        let (name, parameter) = NUMBERS[k].split_once('.').unwrap_or((NUMBERS[k], "value"));
        Effect { name: name.into(), parameters: BTreeMap::from([(parameter.to_owned(), number(k))]) }
    };
    let key = Key {
        schema: String::new(),
        unit: unit.into(),
        at,
        log: at.to_string(),
        model: String::new(),
        after: None,
    };
    let effects = (0..4).map(effect).collect();
    Kept { key, unchanged: true, outcome: Told { verdict: "named".into(), effects, ..Told::default() } }
}

fn fleet(seed: u64, arguments: &Arguments, change: impl Fn(u32) -> Change) -> Vec<(String, Vec<Kept>)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..arguments.units).map(|k| unit(&mut rng, k, arguments.days, change(k))).collect()
}

fn seeds(arguments: &Arguments) -> std::ops::Range<u64> {
    u64::from(arguments.first)..u64::from(arguments.first) + arguments.fleets
}

/// Fleets in which nothing changes: spread, its intervals, alarms.
fn quiet(arguments: &Arguments, page: &mut Page) {
    let of = |seed| Findings::of(&fleet(seed, arguments, |_| Change::Quiet), Method::Reml, RATE);
    let all: Vec<Findings> = seeds(arguments).into_par_iter().map(of).collect();
    let spreads: Vec<_> = all.iter().flat_map(|findings| &findings.spread).map(|it| it.spread).collect();
    let holds = |[low, high]: [f64; 2], truth: f64| low <= truth && truth <= high;
    let near = spreads.iter().filter(|it| (it.between / BETWEEN - 1.0).abs() <= 0.1).count();
    let between = spreads.iter().filter(|it| holds(it.between_interval, BETWEEN)).count();
    let mean = spreads.iter().filter(|it| holds(it.mean_interval, 10.0)).count();
    let alarmed = all.iter().filter(|findings| !findings.changed.is_empty()).count();
    let alarms: usize = all.iter().map(|findings| findings.changed.len()).sum();
    let tests: usize = all.iter().map(|findings| findings.tests).sum();
    let part = |count: usize| format!("{:.1} %", 100.0 * count as f64 / spreads.len() as f64);
    page.line(format!(
        "Drawn results, {} fleets of {} units × {} days, nothing changes:",
        all.len(),
        arguments.units,
        arguments.days
    ));
    page.line(format!("\n- spread within 10 % of the truth: {} of {} numbers", part(near), spreads.len()));
    page.line(format!("- 95 % intervals that hold: spread {}, mean {}", part(between), part(mean)));
    page.line(format!(
        "- fleets with any alarm: {alarmed} of {}; alarms: {alarms} in {tests} tests\n",
        all.len()
    ));
}

/// Fleets in which a part of the units drifts and another of the same size steps.
fn changing(arguments: &Arguments, page: &mut Page, part: f64, size: f64) {
    let changed = (part * f64::from(arguments.units)).round() as u32;
    let drawn = |unit: u32| match unit {
        _ if unit < changed => Change::Drift(size),
        _ if unit < 2 * changed => Change::Step(size),
        _ => Change::Quiet,
    };
    let of = |seed| Findings::of(&fleet(seed ^ 1 << 32, arguments, drawn), Method::Reml, RATE).changed;
    let all: Vec<Changed> = seeds(arguments).into_par_iter().flat_map_iter(of).collect();
    let truth = |it: &Changed| {
        let unit: u32 = it.unit.parse().expect("a number");
        let own = it.quantity.starts_with(NUMBERS[(unit % 4) as usize]);
        if own { drawn(unit) } else { Change::Quiet }
    };
    let count = |of: &dyn Fn(&Changed) -> bool| all.iter().filter(|it| of(it)).count() as f64;
    let total = f64::from(changed) * arguments.fleets as f64;
    let drifts = count(&|it| matches!(truth(it), Change::Drift(_)));
    let steps = count(&|it| matches!(truth(it), Change::Step(_)));
    let called = |it: &Changed| {
        matches!(
            (truth(it), format!("{:?}", it.kind).as_str()),
            (Change::Drift(_), "Drift") | (Change::Step(_), "Step")
        )
    };
    page.line(format!(
        "- {:.0} % of the units drift by {size} σ of one log from the first to the last day, as many step by it: drifts found {:.1} %, steps \
         found {:.1} %, false among all alarms {:.1} %, called by the right kind {:.1} %",
        100.0 * part,
        100.0 * drifts / total,
        100.0 * steps / total,
        100.0 * count(&|it| truth(it) == Change::Quiet) / all.len().max(1) as f64,
        100.0 * count(&called) / (drifts + steps).max(1.0)
    ));
}

/// Motors, logs and checks.
fn end_to_end(arguments: &Arguments, page: &mut Page) {
    for seed in arguments.first..arguments.first + arguments.kinds {
        let fleet = Fleet::draw(seed, arguments.days, arguments.rows);
        let folder = arguments.folder.join(seed.to_string());
        let pilot =
            checked(&fleet, &[const { Fate::Quiet }; 4], &folder.join("pilot")).expect("the pilot runs").1;
        let part = SIZE * scatter(&pilot);
        let fates = fates(&fleet, arguments.units, part);
        let (summary, results) = checked(&fleet, &fates, &folder.join("fleet")).expect("the fleet runs");
        let findings = Findings::of(&results, Method::Reml, RATE);
        page.line(format!(
            "\nEnd to end, kind {seed}: {} units × {} days of {} rows; {} searched, {} unchanged, {} there. A friction drifts or steps by \
             {SIZE} σ, which is {:.2} % of it:\n",
            arguments.units, arguments.days, arguments.rows, summary.searched, summary.unchanged, summary.there, 100.0 * part
        ));
        names(page, &fates, &results, &findings);
        alarms(page, &fates, &findings);
        truths(page, &fleet, &fates, &results, &findings);
    }
}

fn fates(fleet: &Fleet, units: u32, part: f64) -> Vec<Fate> {
    let middle = (MIDDLE * f64::from(fleet.days)) as u32;
    let fate = |unit: u32| match unit % 10 {
        1 => Fate::Drifts(part),
        2 => Fate::Steps(part, middle),
        3..=5 => fleet.new_effect(unit, middle),
        _ => Fate::Quiet,
    };
    (1..=units).into_par_iter().map(fate).collect()
}

/// Relative scatter of the friction of a unit from log to log.
fn scatter(pilot: &[(String, Vec<Kept>)]) -> f64 {
    let of = |results: &Vec<Kept>| {
        let values: Vec<f64> = results.iter().filter_map(friction).map(|number| number[0]).collect();
        let (n, mean) = (values.len() as f64, values.iter().sum::<f64>() / values.len() as f64);
        values.iter().map(|value| (value / mean - 1.0).powi(2)).sum::<f64>() / (n - 1.0)
    };
    (pilot.iter().map(|(_, results)| of(results)).sum::<f64>() / pilot.len() as f64).sqrt()
}

/// Value and sigma of a log's friction.
fn friction(kept: &Kept) -> Option<[f64; 2]> {
    let effect = kept.outcome.effects.iter().find(|effect| effect.name == effects::COULOMB_FRICTION.name)?;
    let number = effect.parameters.get("level_nm")?;
    Some([number.value?, number.std?])
}

/// Are new effects named on the unit, and none on others?
fn names(page: &mut Page, fates: &[Fate], results: &[(String, Vec<Kept>)], findings: &Findings) {
    let (mut named, mut tied, mut drawn, mut others, mut quiet) = (0, 0, 0, 0, 0);
    for (fate, (unit, kept)) in fates.iter().zip(results) {
        let told = findings.appeared.iter().filter(|it| it.unit == *unit && it.confirmed);
        let told: Vec<&str> = told.map(|it| it.effect.as_str()).collect();
        let Fate::Gets(effect, ..) = fate else {
            quiet += 1;
            others += usize::from(!told.is_empty());
            continue;
        };
        drawn += 1;
        if told.contains(&effect.name) {
            named += 1;
            continue;
        }
        let last = &kept[kept.len() - 1].outcome;
        tied += usize::from(
            last.ties.iter().flat_map(|tie| tie.rivals.iter().flatten()).any(|it| it == effect.name),
        );
        eprintln!("{unit}: {} told as {told:?}, last log {:?}, {}", effect.name, last.names(), last.verdict);
    }
    page.line(format!(
        "- new effects named on their unit and confirmed: {named} of {drawn} ({:.1} %); {tied} more stand as a rival of a tie in the last log",
        100.0 * f64::from(named) / f64::from(drawn.max(1))
    ));
    page.line(format!("- other units with a confirmed new effect: {others} of {quiet}"));
}

/// Are drifts and steps found, and no others?
fn alarms(page: &mut Page, fates: &[Fate], findings: &Findings) {
    let fate = |it: &Changed| &fates[it.unit.parse::<usize>().expect("a number") - 1];
    let friction = |it: &Changed| it.quantity == "coulomb_friction.level_nm";
    let count = |of: &dyn Fn(&Changed) -> bool| findings.changed.iter().filter(|it| of(it)).count();
    let drawn = |of: fn(&Fate) -> bool| fates.iter().filter(|fate| of(fate)).count();
    let (drifts, steps) =
        (|it: &Fate| matches!(it, Fate::Drifts(_)), |it: &Fate| matches!(it, Fate::Steps(..)));
    page.line(format!(
        "- friction found to change: {} of {} that drift, {} of {} that step; alarms on quiet units: {} of {} in {} tests; on units with a \
         new effect, which moves other numbers: {}; of other numbers of units whose friction changes: {}",
        count(&|it| friction(it) && drifts(fate(it))),
        drawn(drifts),
        count(&|it| friction(it) && steps(fate(it))),
        drawn(steps),
        count(&|it| *fate(it) == Fate::Quiet),
        findings.changed.len(),
        findings.tests,
        count(&|it| matches!(fate(it), Fate::Gets(..))),
        count(&|it| !friction(it) && (drifts(fate(it)) || steps(fate(it)))),
    ));
}

/// Is the spread what was drawn, and are the errors what they are said to be?
fn truths(
    page: &mut Page,
    fleet: &Fleet,
    fates: &[Fate],
    results: &[(String, Vec<Kept>)],
    findings: &Findings,
) {
    let truths: Vec<f64> = (1..=fates.len() as u32).map(|unit| fleet.friction_nm(unit)).collect();
    let (n, mean) = (truths.len() as f64, truths.iter().sum::<f64>() / truths.len() as f64);
    let drawn = (truths.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    if let Some(it) = findings.spread.iter().find(|it| it.quantity == "coulomb_friction.level_nm") {
        page.line(format!(
            "- spread of the friction: {:.4e} N m, drawn {drawn:.4e} ({:+.1} %); 95 % {:.4e} … {:.4e}; logs scatter by {:.2} of what they tell",
            it.spread.between,
            100.0 * (it.spread.between / drawn - 1.0),
            it.spread.between_interval[0],
            it.spread.between_interval[1],
            it.scatter
        ));
    }
    let quiet = fates.iter().zip(&truths).zip(results).filter(|((fate, _), _)| **fate == Fate::Quiet);
    let errors = quiet.flat_map(|((_, truth), (_, kept))| {
        kept.iter().filter_map(friction).map(move |[value, sigma]| (value - truth) / sigma)
    });
    let errors: Vec<f64> = errors.collect();
    let held = errors.iter().filter(|z| z.abs() <= 1.96).count();
    page.line(format!(
        "- friction of single logs of quiet units against the truth: within 1.96 of its sigmas in {:.1} % of {}",
        100.0 * held as f64 / errors.len().max(1) as f64,
        errors.len()
    ));
}

/// Each unit with its results.
type Units = Vec<(String, Vec<Kept>)>;

fn checked(fleet: &Fleet, fates: &[Fate], folder: &Path) -> anyhow::Result<(Summary, Units)> {
    fleet.write(folder, fates)?;
    let store = Store::new(&folder.join("results"));
    let summary = ingest::run(&manifest::read(&folder.join("manifest.csv"))?, &store, 0, &|_, _| ())?;
    anyhow::ensure!(summary.failed.is_empty(), "{}", summary.failed.join("; "));
    Ok((summary, store.all()?))
}
