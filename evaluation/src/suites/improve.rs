//! `truing improve` on drawn motors: `cargo run -p evaluation -- improve --motors 20`.
//!
//! Every motor is one of the case generator's, with effects that nobody is told of, behind the servo's library. The servo knows
//! supply, rated speed and encoder. With `--image` the image in QEMU is the servo, and the library once more beside it. One run of the
//! loop; afterwards the same motor, with other noise, follows a sine at a fifth of full speed and a slow crawl with the numbers of
//! before and of after.

use evaluation::Results;
use evaluation::answers::{deviations, names_are_right};
use rayon::prelude::*;
use std::time::Instant;
use trials::case_motor::{CaseMotor, config};
use trials::firmware;
use trials::host_servo::{HostServo, Outside};
use truing::device::link::{Lockstep, Wire};
use truing::device::session::Listening;
use truing::improve::bench::Bench;
use truing::improve::candidate;
use truing::improve::history;
use truing::improve::improving::{self, Improved, Job};
use truing::improve::trial::{self, COUNT_RMS, Tried};
use truing::synthetic::cases::{self, Case, Set, Spec};
use truing::system::effects::SUPPLY_SAG;
use truing::system::model;

/// Improves drawn motors.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Motors.
    #[arg(long, default_value_t = 20)]
    motors: usize,
    /// First seed.
    #[arg(long, default_value_t = 1)]
    first: u32,
    /// Effects that hide in each motor: 0 … 4.
    #[arg(long, default_value_t = 1)]
    effects: usize,
    /// An effect that the library does not know hides in each instead.
    #[arg(long)]
    outside: bool,
    /// Only motors in which this effect hides, by its name.
    #[arg(long)]
    hidden: Option<String>,
    /// Motor time of each, s.
    #[arg(long, default_value_t = 60.0)]
    budget_s: f64,
    /// Give the loop the data sheet, too: the linear model, off by its tolerance.
    #[arg(long)]
    sheet: bool,
    /// Through the image in QEMU, and a second time through the library; the last column tells whether both ended alike.
    #[arg(long)]
    image: bool,
    /// Tell how each of them goes, as the command does.
    #[arg(long)]
    tell: bool,
    #[command(flatten)]
    results: Results,
}

const SETS: [Set; 5] = [Set::Nothing, Set::Single, Set::Pair, Set::Triple, Set::Quadruple];
const LISTENING: Listening = Listening { axis: 0, every: 1 };
/// How many times smaller the errors are to be.
const GOAL: f64 = 7.0;
/// Half width of a 95 % interval, standard deviations.
const HALF_WIDTH: f64 = 1.96;
/// Noise of the motor that judges is another.
const OTHER_NOISE: u64 = 1 << 32;

/// One motor.
struct Seen {
    seed: u32,
    hidden: String,
    named: String,
    outcome: String,
    motor_s: f64,
    host_s: f64,
    /// How many times smaller the errors are, sine and crawl; 1 where nothing was kept.
    ratios: Option<[f64; 2]>,
    /// Can the encoder show an error that many times smaller than that of before? True where nobody looked.
    shows: [bool; 2],
    kept: bool,
    /// Numbers in force in the end, of what was kept last.
    numbers: Vec<f64>,
    /// Is all that hides as large as the noise, and not the supply, which the servo logs? Then: was it named, and nothing else?
    named_right: Option<bool>,
    /// Was an experiment made to part the names of a tie? Then: is no tie left?
    parted: Option<bool>,
    /// (estimate − truth)/std of the parameters of rightly named effects.
    deviations: Vec<f64>,
}

/// What runs the control tick.
#[derive(Clone, Copy)]
enum Through {
    Library,
    Image,
}

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    let set = if arguments.outside { Set::Outside } else { SETS[arguments.effects.min(4)] };
    let spec = Spec { evaluation: true, ..Spec::new(set) };
    let hides = |case: &Case| {
        let hides = |name: &str| case.answer.hidden.iter().any(|it| it.name == name);
        arguments.hidden.as_ref().is_none_or(|names| names.split(',').all(hides))
    };
    let seeds: Vec<u32> = (arguments.first..)
        .filter(|&seed| {
            let case = cases::draw(&spec, seed);
            hides(&case) && CaseMotor::new(&case, 0).is_some()
        })
        .take(arguments.motors)
        .collect();
    let through = if arguments.image { Through::Image } else { Through::Library };
    let every = |through| {
        seeds.par_iter().map(|&seed| improved(&arguments, &spec, seed, through)).collect::<Vec<_>>()
    };
    let seen = every(through);
    page.line("| motor | hidden | named | outcome | motor time, s | sine, error before / after | crawl, error before / after |\n|---|---|---|---|---|---|---|");
    for it in &seen {
        let [sine, crawl] = it
            .ratios
            .map_or(["–".into(), "–".into()], |ratios| ratios.map(|ratio| format!("{ratio:.3}")));
        let Seen { seed, hidden, named, outcome, motor_s, .. } = it;
        page.line(format!("| {seed} | {hidden} | {named} | {outcome} | {motor_s:.1} | {sine} | {crawl} |"));
    }
    summary(&mut page, &seen, arguments.sheet);
    if arguments.image {
        compare(&mut page, &seen, &every(Through::Library));
    }
    let last = seeds.last().copied().unwrap_or_default();
    page.close(&format!("{} … {last}, those with an encoder at the motor", arguments.first));
}

fn summary(page: &mut evaluation::Page, seen: &[Seen], sheet: bool) {
    let kept = seen.iter().filter(|it| it.kept).count();
    let worse = seen
        .iter()
        .filter_map(|it| it.ratios)
        .filter(|ratios| ratios.iter().any(|ratio| *ratio < 1.0))
        .count();
    let median = |which: usize, of: &[&Seen]| {
        let mut ratios: Vec<f64> = of.iter().filter_map(|it| Some(it.ratios?[which])).collect();
        ratios.sort_by(f64::total_cmp);
        ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let all: Vec<&Seen> = seen.iter().collect();
    let improved: Vec<&Seen> = seen.iter().filter(|it| it.kept).collect();
    page.line(format!("\n{} motors, {kept} improved, {worse} worse in a motion afterwards.", seen.len()));
    for (what, of) in [("all", &all), ("improved", &improved)] {
        page.line(format!("Median ratio, {what}: sine {:.3}, crawl {:.3}.", median(0, of), median(1, of)));
    }
    let shown = |which: usize| all.iter().copied().filter(|it| it.shows[which]).collect::<Vec<_>>();
    let [sines, crawls] = [0, 1].map(shown);
    page.line(format!(
        "Of {} sines and {} crawls the encoder can show a {GOAL} times smaller error: {:.3}, {:.3}.",
        sines.len(),
        crawls.len(),
        median(0, &sines),
        median(1, &crawls)
    ));
    let share = |of: fn(&Seen) -> Option<bool>| {
        let told: Vec<bool> = seen.iter().filter_map(of).collect();
        format!("{} of {}", told.iter().filter(|right| **right).count(), told.len())
    };
    page.line(format!(
        "Named, of what is as large as the noise: {}; ties that an experiment has parted: {}.",
        share(|it| it.named_right),
        share(|it| it.parted)
    ));
    let mut errors: Vec<f64> = seen.iter().flat_map(|it| &it.deviations).map(|it| it.abs()).collect();
    errors.sort_by(f64::total_cmp);
    // Only a data sheet and what hides have the same units.
    if let Some(middle) = errors.get(errors.len() / 2).filter(|_| sheet) {
        let held = errors.iter().filter(|it| **it <= HALF_WIDTH).count();
        page.line(format!(
            "95 % intervals that hold the truth: {held} of {}; half width over error, median: {:.1}.",
            errors.len(),
            HALF_WIDTH / middle
        ));
    }
    let slowest = seen.iter().map(|it| it.host_s).fold(0.0, f64::max);
    let longest = seen.iter().map(|it| it.motor_s).fold(0.0, f64::max);
    page.line(format!("Motor time at most {longest:.1} s; host time at most {slowest:.1} s."));
}

/// Did image and library end alike?
fn compare(page: &mut evaluation::Page, image: &[Seen], library: &[Seen]) {
    let pairs = || image.iter().zip(library);
    let named = pairs().filter(|(a, b)| a.named == b.named).count();
    let ended = pairs().filter(|(a, b)| a.outcome == b.outcome).count();
    for (a, b) in pairs().filter(|(a, b)| (&a.named, &a.outcome) != (&b.named, &b.outcome)) {
        page.line(format!("{} through the library: {}; {}", a.seed, b.named, b.outcome));
    }
    let apart = pairs().map(|(a, b)| apart(a, b)).fold(0.0, f64::max);
    page.line(format!(
        "Of {} motors, image and library named the same in {named} and ended alike in {ended}; numbers in force where both kept as many are \
         at most {:.2} % apart.",
        image.len(),
        100.0 * apart
    ));
}

/// The largest relative difference of the numbers of two runs of one motor.
fn apart(a: &Seen, b: &Seen) -> f64 {
    let same = a.numbers.len() == b.numbers.len();
    let pairs = a.numbers.iter().zip(&b.numbers).filter(|(a, b)| same && a != b);
    pairs.map(|(a, b)| ((a - b) / a).abs()).fold(0.0, f64::max)
}

fn servo(case: &Case, noise: u64, through: Through) -> Box<dyn Wire> {
    let motor = Box::new(CaseMotor::new(case, noise).expect("it was asked before"));
    match through {
        Through::Library => Box::new(HostServo::power_up(motor, config(case), &Outside::default())),
        Through::Image => Box::new(Lockstep::start(&firmware::qemu(), motor, config(case)).expect("QEMU")),
    }
}

/// One run of the loop, and what it was worth.
fn improved(arguments: &Arguments, spec: &Spec, seed: u32, through: Through) -> Seen {
    let case = cases::draw(spec, seed);
    let folder = tempfile::tempdir().expect("a folder");
    let begin = Instant::now();
    let job = Job {
        setup: config(&case).into(),
        model: arguments.sheet.then(|| sheet(&case)),
        out: folder.path().to_owned(),
        budget_s: arguments.budget_s,
        seed: u64::from(seed),
        analyse: Box::new(candidate::analysed),
    };
    let bench = Bench::new(servo(&case, u64::from(seed), through), LISTENING);
    let mut tell = |text: &str| {
        if arguments.tell {
            eprintln!("{seed}: {text}");
        }
    };
    let found = improving::run(bench, job, &mut tell);
    for entry in found.iter().flat_map(|found| &found.entries) {
        let number = |it: &history::Known| format!("{} {:.4} {}", it.name, it.value, it.unit);
        tell(&entry.numbers.iter().map(number).collect::<Vec<_>>().join(", "));
        for it in entry.trial.iter().flat_map(|trial| &trial.motions) {
            tell(&format!(
                "{:?}: {:?} rad with the old numbers, {:?} with the new ones",
                it.motion, it.old_rms_rad, it.new_rms_rad
            ));
        }
    }
    if let Ok(Improved { began_with: Some(began), .. }) = &found {
        tell(&format!("began with {:?}", began.estimates));
    }
    let host_s = begin.elapsed().as_secs_f64();
    let hidden: Vec<String> =
        case.answer.hidden.iter().map(|it| format!("{} ({:.1} σ)", it.name, it.visibility)).collect();
    let seen = Seen {
        seed,
        hidden: case.answer.outside.map_or_else(|| hidden.join(", "), str::to_owned),
        named: "–".into(),
        outcome: String::new(),
        motor_s: f64::NAN,
        host_s,
        ratios: None,
        shows: [true; 2],
        kept: false,
        numbers: Vec::new(),
        named_right: None,
        parted: None,
        deviations: Vec::new(),
    };
    match found {
        Ok(found) => {
            // A later round begins from the names of those before.
            let mut names = found.entries.iter().rev().map(|entry| entry.names.join(", "));
            let names = names.find(|names| !names.is_empty()).unwrap_or_default();
            let judged = if found.improved { judged(&case, &found, through) } else { Some([(1.0, true); 2]) };
            let outcome = format!("{}: {}", if found.improved { "kept" } else { "as it was" }, found.why);
            let kept = found.entries.iter().rev().find(|entry| entry.kept);
            let numbers = kept.iter().flat_map(|entry| &entry.numbers).map(|it| it.value).collect();
            let last = found.outcomes.iter().rfind(|it| !it.effects.is_empty());
            let told = last.or(found.outcomes.first());
            let shows = case.answer.outside.is_none()
                && case.answer.hidden.iter().all(|it| it.visibility >= 1.0 && it.name != SUPPLY_SAG.name);
            let mut deviations = told.map(|it| deviations(&case.answer, it)).unwrap_or_default();
            // Of the motor it counts from power-up, of the model from the start of the recording.
            deviations.retain(|(name, _)| name != "periodic_load.phase_rad");
            deviations
                .iter()
                .for_each(|(name, it)| tell(&format!("{name}: {it:.2} standard deviations off")));
            let experiments =
                found.entries.iter().zip(&found.outcomes).filter(|(entry, _)| entry.logs.len() > 1);
            Seen {
                named_right: shows.then(|| told.is_some_and(|it| names_are_right(&case.answer, it))),
                parted: experiments.map(|(_, outcome)| outcome.ties.is_empty()).reduce(|a, b| a && b),
                deviations: deviations.into_iter().map(|(_, it)| it).collect(),
                named: names,
                outcome,
                motor_s: found.motor_s,
                ratios: judged.map(|judged| judged.map(|(ratio, _)| ratio)),
                shows: judged.map_or([true; 2], |judged| judged.map(|(_, shows)| shows)),
                kept: found.improved,
                numbers,
                ..seen
            }
        }
        Err(error) => Seen { outcome: format!("{error:#}"), ..seen },
    }
}

/// The data sheet, with the encoder of the servo.
fn sheet(case: &Case) -> model::Model {
    let mut model = model::parse("sheet.toml", &case.model).expect("a model");
    let encoder = format!("counts_per_rev = {}", config(case).counts_per_rev);
    let text: Vec<String> = case
        .model
        .lines()
        .map(|line| if line.starts_with("counts_per_rev") { encoder.clone() } else { line.to_owned() })
        .filter(|line| {
            !["speed =", "speed_window_s", "current_logged", "sample_hz"]
                .iter()
                .any(|key| line.starts_with(key))
        })
        .collect();
    model = model::parse(&model.source, &text.join("\n")).expect("a model");
    model
}

/// Errors of before over errors of after, and whether the encoder's own steps leave room for the goal.
fn judged(case: &Case, found: &Improved, through: Through) -> Option<[(f64, bool); 2]> {
    let mut bench = Bench::new(servo(case, OTHER_NOISE, through), LISTENING);
    let steps = COUNT_RMS * std::f64::consts::TAU / f64::from(config(case).counts_per_rev);
    match trial::run(&mut bench, [&found.began_with?, &found.in_force?], f64::INFINITY).ok()? {
        Tried::Whole(trial) => {
            let smallest = |rms: &[f64]| rms.iter().copied().fold(f64::INFINITY, f64::min);
            let judged = trial
                .motions
                .iter()
                .map(|it| (it.ratio.mean, smallest(&it.old_rms_rad) >= GOAL * steps))
                .collect::<Vec<_>>();
            judged.try_into().ok()
        }
        Tried::Faulted(..) | Tried::OutOfTime => None,
    }
}
