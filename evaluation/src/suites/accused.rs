//! Right files, and files with bad cells: `cargo run -p evaluation -- accused --right 3000` and `--bad 500`.
//!
//! Motors are drawn with and without dry friction and a dead zone, under steps of many levels or of two, sweeps and ramps, with rows from
//! 1 to 50 ms, and sensors from noise-free to whole turns a minute. Nothing is wrong with the files: whatever is said of them is an
//! accusation. With `--bad` one to ten cells of such a file are spoilt, anywhere in any column; their lines must be told and no name that is
//! not there may come of them.

use evaluation::Results;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use truing::gap::{self, Options, examine};
use truing::outcome::Verdict;
use truing::system::effects;
use truing::system::log::{self, Columns, Log, Reading};
use truing::system::model::{self, Model};

#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Right files that are drawn.
    #[arg(long, default_value_t = 0)]
    right: u64,
    /// Files with bad cells that are drawn.
    #[arg(long, default_value_t = 0)]
    bad: u64,
    /// Only read the files with bad cells, do not search.
    #[arg(long)]
    read_only: bool,
    /// First seed.
    #[arg(long, default_value_t = 1)]
    first: u64,
    #[command(flatten)]
    results: Results,
}

/// What a motor really is, and what its sheet says.
struct Motor {
    resistance: f64,
    constant: f64,
    inertia: f64,
    damping: f64,
    friction: f64,
    zone: f64,
}

impl Motor {
    fn random(random: &mut ChaCha8Rng) -> Self {
        let (resistance, constant) = (random.random_range(0.5..6.0), random.random_range(0.01..0.1));
        // A time constant from 15 to 150 ms.
        let time: f64 = 0.015 * 10f64.powf(random.random());
        let inertia = time * constant * constant / resistance;
        let stall = constant * 12.0 / resistance;
        let has = random.random_range(0..4);
        Self {
            resistance,
            constant,
            inertia,
            damping: 0.01 * stall * constant / 12.0,
            friction: if has == 1 || has == 3 { stall * random.random_range(0.03..0.15) } else { 0.0 },
            zone: if has >= 2 { random.random_range(0.3..1.8) } else { 0.0 },
        }
    }

    fn names(&self) -> Vec<&'static str> {
        let friction = (self.friction > 0.0).then_some(effects::COULOMB_FRICTION.name);
        friction.into_iter().chain((self.zone > 0.0).then_some(effects::DEAD_ZONE.name)).collect()
    }

    fn sheet(&self, random: &mut ChaCha8Rng) -> String {
        let mut off = |value: f64| value * (1.0 + 0.04 * (random.random::<f64>() - 0.5));
        format!(
            "schema = \"truing-model/1\"\n[model]\nkind = \"dc_motor\"\n[motor]\nR_ohm = {}\nKt_nm_per_a = {}\nKe_vs_per_rad = {}\n\
             J_kgm2 = {:e}\nb_nms_per_rad = {:e}\n[supply]\nnominal_v = 12.0\n",
            off(self.resistance),
            off(self.constant),
            off(self.constant),
            off(self.inertia),
            off(self.damping)
        )
    }

    /// Speed, angle and current at every row.
    fn run(&self, volts: &[f64], step_s: f64) -> Vec<[f64; 3]> {
        let (mut omega, mut theta) = (0.0_f64, 0.0);
        let parts = (step_s / 1e-4).ceil();
        let short = step_s / parts;
        let row = |u: &f64| {
            let beyond = u.signum() * (u.abs() - self.zone).max(0.0);
            let at = [omega, theta, (beyond - self.constant * omega) / self.resistance];
            for _ in 0..parts as usize {
                let torque =
                    self.constant * (beyond - self.constant * omega) / self.resistance - self.damping * omega;
                let taken = torque
                    - if omega == 0.0 {
                        torque.clamp(-self.friction, self.friction)
                    } else {
                        self.friction * omega.signum()
                    };
                let next = omega + short * taken / self.inertia;
                // Friction holds what passes through rest.
                let next = if next * omega < 0.0 && torque.abs() <= self.friction { 0.0 } else { next };
                theta += 0.5 * short * (omega + next);
                omega = next;
            }
            at
        };
        volts.iter().map(row).collect()
    }
}

fn volts(random: &mut ChaCha8Rng, rows: usize, step_s: f64) -> Vec<f64> {
    let kind = random.random_range(0..5);
    let hold = ((0.05 + 0.4 * random.random::<f64>()) / step_s).ceil() as usize;
    let level = 4.0 + 7.0 * random.random::<f64>();
    let mut held = 0.0;
    let length = rows as f64 * step_s;
    (0..rows)
        .map(|row| {
            let t = row as f64 * step_s;
            match kind {
                0 | 1 => {
                    if row % hold == 0 {
                        held = level * random.random_range(-1.0..1.0_f64);
                    }
                    held
                }
                2 => {
                    if row % hold == 0 {
                        held = if random.random() { level } else { -level };
                    }
                    held
                }
                3 => level * (TAU * (0.3 * t + t * t / length)).sin(),
                _ => level * (4.0 * (t / length - (t / length + 0.5).floor()).abs() - 1.0),
            }
        })
        .collect()
}

/// A file: its columns, row by row.
struct File {
    header: Vec<&'static str>,
    rows: Vec<Vec<f64>>,
}

impl File {
    fn text(&self) -> String {
        let line = |row: &Vec<f64>| row.iter().map(|cell| format!("{cell}")).collect::<Vec<_>>().join(",");
        let lines = self.rows.iter().map(line);
        std::iter::once(self.header.join(",")).chain(lines).collect::<Vec<_>>().join("\n")
    }
}

/// A motor, its sheet, a log and a held-out record.
struct Case {
    motor: Motor,
    sheet: String,
    log: File,
    holdout: File,
}

fn random_case(seed: u64) -> Case {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let motor = Motor::random(random);
    let sheet = motor.sheet(random);
    let step_s = *[0.001, 0.002, 0.005, 0.01, 0.02, 0.05].choose(random).expect("some");
    let rows = (1500.0 + 2500.0 * random.random::<f64>()) as usize;
    let fastest = 12.0 / motor.constant;
    let noise = *[0.0, 1e-4, 3e-3].choose(random).expect("some") * fastest;
    let grid = *[0.0, 0.1 * TAU / 60.0, TAU / 60.0, 0.01 * fastest].choose(random).expect("some");
    let (turns, columns) = (TAU / 4096.0, random.random_range(0..4));
    let file = |random: &mut ChaCha8Rng| {
        let volts = volts(random, rows, step_s);
        let seen = motor.run(&volts, step_s);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        let row = |(k, [omega, theta, current]): (usize, [f64; 3])| {
            let speed = omega + noise * normal();
            let speed = if grid > 0.0 { (speed / grid).round() * grid } else { speed };
            let angle = (theta / turns).round() * turns;
            let current = current + 0.005 * normal();
            let all = [vec![speed], vec![angle], vec![speed, angle], vec![speed, current]];
            [vec![k as f64 * step_s, volts[k]], all[columns].clone()].concat()
        };
        let more = [
            vec!["omega_rad_s"],
            vec!["theta_rad"],
            vec!["omega_rad_s", "theta_rad"],
            vec!["omega_rad_s", "i_a"],
        ];
        let header = [vec!["t_s", "u_v"], more[columns].clone()].concat();
        File { header, rows: seen.into_iter().enumerate().map(row).collect() }
    };
    let (log, holdout) = (file(random), file(random));
    Case { motor, sheet, log, holdout }
}

fn opened(name: &str, case: &Case, file: &File) -> Result<Reading, String> {
    let columns = Columns::of("", &parsed(case, false)).expect("no columns");
    log::parse_bytes(name, file.text().as_bytes(), &columns).map_err(|error| error.to_string())
}

fn parsed(case: &Case, fitted: bool) -> Model {
    let text = if fitted {
        case.sheet.replacen("[model]", "[model]\nfitted_to_log = true", 1)
    } else {
        case.sheet.clone()
    };
    model::parse("model.toml", &text).expect("a drawn model")
}

/// What is said of a right file.
fn said(seed: u64) -> Option<String> {
    let case = random_case(seed);
    let read = opened("log.csv", &case, &case.log)
        .and_then(|log| Ok((log, opened("holdout.csv", &case, &case.holdout)?)));
    let (log, holdout) = match read {
        Ok(read) => read,
        Err(text) => return Some(text),
    };
    let model = parsed(&case, seed.is_multiple_of(3));
    let mut all: Vec<String> =
        [&log, &holdout].into_iter().flat_map(|reading| reading.notes.clone()).collect();
    let holdouts = [holdout.log];
    all.extend(examine::put_right(&model, &log.log, &holdouts).notes);
    all.extend(examine::faults(&model, &log.log, &holdouts).into_iter().map(|fault| fault.what));
    (!all.is_empty())
        .then(|| format!("- {seed}, {:?} {:?}: {}", case.motor.names(), case.log.header, all.join("; ")))
}

/// Spoils a cell; its row and column if that can be seen.
fn spoilt(random: &mut ChaCha8Rng, file: &mut File, row: usize) -> Option<(usize, usize)> {
    let column = random.random_range(1..file.header.len());
    let values = || file.rows.iter().map(|row| row[column]);
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let before = file.rows[row][column];
    let bad = match random.random_range(0..6) {
        0 => -9999.0,
        1 => 0.0,
        2 => 255.0,
        3 => {
            if column == 1 {
                24.0
            } else {
                2.0 * high
            }
        }
        4 => before + (high - low) * random.random_range(0.6..2.0),
        _ => 65535.0,
    };
    file.rows[row][column] = bad;
    ((bad - before).abs() > 0.15 * (high - low)).then_some((row, column))
}

/// The names of a verdict, if it is one of names.
fn named(case: &Case, log: &Log, holdout: &Log) -> Vec<String> {
    let outcome =
        gap::run(&parsed(case, false), log, std::slice::from_ref(holdout), &Options::default(), &|_| ());
    let outcome = outcome.ok().filter(|outcome| outcome.verdict == Verdict::Named);
    outcome.into_iter().flat_map(|outcome| outcome.effects).map(|effect| effect.name).collect()
}

/// What became of bad cells: those that can be seen, those that were told, a false name, and a line for the page.
fn asked(seed: u64, read_only: bool) -> (usize, usize, bool, String) {
    let (mut case, right) = (random_case(seed), random_case(seed));
    let random = &mut ChaCha8Rng::seed_from_u64(seed ^ 0xBAD);
    let count = random.random_range(1..=10);
    let rows: BTreeSet<usize> = (0..count).map(|_| random.random_range(0..case.log.rows.len())).collect();
    let seen: Vec<(usize, usize)> =
        rows.into_iter().filter_map(|row| spoilt(random, &mut case.log, row)).collect();
    let (log, holdout) = match opened("log.csv", &case, &case.log) {
        Ok(log) => (log, opened("holdout.csv", &case, &case.holdout).expect("a right file")),
        Err(text) => return (seen.len(), seen.len(), false, format!("- {seed}: {text}")),
    };
    let text = log.notes.join("; ");
    let is_told = |(row, _): &&(usize, usize)| {
        let line = row + 2;
        text.contains(&format!("line {line}:"))
            || text.contains(&format!("lines {line} "))
            || text.contains(&format!("to {line}:"))
    };
    let told = seen.iter().filter(is_told).count();
    let untold: Vec<String> = seen
        .iter()
        .filter(|cell| !is_told(cell))
        .map(|(row, column)| {
            let around = row.saturating_sub(1)..(row + 2).min(case.log.rows.len());
            let values = around.map(|row| case.log.rows[row][*column]);
            format!("{}: {} {:?}", row + 2, case.log.header[*column], values.collect::<Vec<_>>())
        })
        .collect();
    let known = case.motor.names();
    let is_false = |names: &[String]| names.iter().any(|name| !known.contains(&name.as_str()));
    let names = if read_only { Vec::new() } else { named(&case, &log.log, &holdout.log) };
    let false_name = is_false(&names);
    let unspoilt = if false_name {
        let right = opened("log.csv", &right, &right.log).expect("a right file");
        format!("; unspoilt {:?}", named(&case, &right.log, &holdout.log))
    } else {
        String::new()
    };
    let line = format!(
        "- {seed}, {:?}: told {told} of {}, named {names:?}{unspoilt}; untold {untold:?}",
        case.motor.names(),
        seen.len()
    );
    (seen.len(), told, false_name, line)
}

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    let seeds = |count: u64| arguments.first..arguments.first + count;
    if arguments.right > 0 {
        let accused: Vec<String> = seeds(arguments.right).into_par_iter().filter_map(said).collect();
        page.line(format!("{} of {} right files are accused.", accused.len(), arguments.right));
        accused.iter().for_each(|line| page.line(line));
    }
    if arguments.bad > 0 {
        let answers: Vec<_> =
            seeds(arguments.bad).into_par_iter().map(|seed| asked(seed, arguments.read_only)).collect();
        let sum = |of: fn(&(usize, usize, bool, String)) -> usize| answers.iter().map(of).sum::<usize>();
        let (seen, told) = (sum(|it| it.0), sum(|it| it.1));
        page.line(format!(
            "{} files with bad cells: {told} of {seen} lines told, {} false names.",
            answers.len(),
            sum(|it| it.2.into())
        ));
        let missed = answers.iter().filter(|it| it.1 < it.0 || it.2);
        missed.for_each(|it| page.line(&it.3));
    }
    page.close(&format!("from {}", arguments.first));
}
