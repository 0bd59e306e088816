//! Evaluation of the gap workflow on hidden cases:
//! `cargo run -p evaluation -- naming --singles 100 --nothing 100 --lines target/naming.jsonl`.
//!
//! Each case goes through files, as a user's would: the answer stays in memory here, out of the analysis' reach. Lines are
//! appended to `--lines`, and cases that stand there are not run again, so a long evaluation may be interrupted; without
//! counts the table is made from the file alone.

use evaluation::Results;
use evaluation::answers::{deviations, names_are_right};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use trials::case_files::{Opened, opened};
use trials::naming::{Line, report};
use trials::next_experiment::{self, Found, examine};
use truing::gap::acceptance::prediction::Prediction;
use truing::gap::dataset::{Part, prepare};
use truing::gap::fit::hypothesis::Hypothesis;
use truing::gap::{self, Options};
use truing::outcome::Outcome;
use truing::report::{Exporter, model_file::ModelFile};
use truing::synthetic::cases::{Answer, Case, Set, Spec, draw, rms_difference};
use truing::system::log::Dynamic;
use truing::system::model::{self, Model};

#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Cases with one hidden effect.
    #[arg(long, default_value_t = 0)]
    singles: u32,
    /// Cases with one hidden effect and the current logged.
    #[arg(long, default_value_t = 0)]
    singles_with_current: u32,
    /// Cases with two hidden effects.
    #[arg(long, default_value_t = 0)]
    pairs: u32,
    /// Cases with three hidden effects.
    #[arg(long, default_value_t = 0)]
    triples: u32,
    /// Cases with nothing hidden.
    #[arg(long, default_value_t = 0)]
    nothing: u32,
    /// Cases with an effect outside the library.
    #[arg(long, default_value_t = 0)]
    outside: u32,
    /// First seed of each set.
    #[arg(long, default_value_t = 1)]
    first: u32,
    /// Rows of log and hold-out.
    #[arg(long, default_value_t = 3000)]
    rows: usize,
    /// Use design seeds: to look at single cases while building.
    #[arg(long)]
    design: bool,
    /// The model files say `fitted_to_log`: where no names reach the noise they go by shares, as on a measured rig.
    #[arg(long)]
    fitted: bool,
    /// Cases at once. CPU times are those of a case with 1.
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// File of lines, appended to.
    #[arg(long, default_value = "target/naming.jsonl")]
    lines: PathBuf,
    /// Short noisy cases whose ties are taken to the rig again, with the suggested experiment and with a random one; prints
    /// their table alone.
    #[arg(long, default_value_t = 0)]
    next_experiments: u32,
    /// Show each case that was not answered right.
    #[arg(long)]
    misses: bool,
    #[command(flatten)]
    results: Results,
}

/// Seeds of cases with the current logged start here, apart from the others of their set.
const WITH_CURRENT: u32 = 1_000_000;

pub fn run(arguments: Arguments) {
    let jobs = rayon::ThreadPoolBuilder::new().num_threads(arguments.jobs).build().expect("threads");
    if arguments.next_experiments > 0 {
        return jobs.install(|| next_experiments(&arguments));
    }
    let done: BTreeSet<(String, u32)> =
        lines(&arguments.lines).into_iter().map(|line| (line.set, line.seed)).collect();
    let mut work = plan(&arguments);
    work.retain(|(spec, seed)| !done.contains(&(text(serde_json::json!(spec.set)), *seed)));
    jobs.install(|| work.par_iter().for_each(|(spec, seed)| record(&arguments, spec, *seed)));
    let lines = lines(&arguments.lines);
    let mut page = arguments.results.page();
    page.print(report(&lines));
    page.close(&seeds(&lines));
}

/// Ties of short noisy logs, and what the suggested experiments are worth.
fn next_experiments(arguments: &Arguments) {
    let spec = next_experiment::spec(!arguments.design);
    let seeds = arguments.first..arguments.first + arguments.next_experiments;
    let found: Vec<Found> = seeds
        .into_par_iter()
        .filter_map(|seed| {
            let found = examine(&spec, seed).map_err(|error| eprintln!("{seed}: {error:#}")).ok()?;
            if let (Found::Tie(trial), true) = (&found, arguments.misses) {
                eprintln!("{trial:?}");
            }
            Some(found)
        })
        .collect();
    let mut page = arguments.results.page();
    page.print(next_experiment::report(&found));
    let last = arguments.first + arguments.next_experiments - 1;
    page.close(&format!("{} to {last}", arguments.first));
}

/// The first and the last seed of each set that the table is made of.
fn seeds(lines: &[Line]) -> String {
    let mut sets: BTreeMap<&str, (u32, u32)> = BTreeMap::new();
    for line in lines {
        let (first, last) = sets.entry(&line.set).or_insert((line.seed, line.seed));
        (*first, *last) = ((*first).min(line.seed), (*last).max(line.seed));
    }
    let sets = sets.iter().map(|(set, (first, last))| format!("{set} {first} to {last}"));
    sets.collect::<Vec<_>>().join(", ")
}

/// The lines written so far.
fn lines(path: &Path) -> Vec<Line> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

/// A name as it is written in JSON.
fn text(value: serde_json::Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

/// CPU time of this process so far, s; `None` where the kernel does not tell.
fn cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // User and system time are the 14th and 15th field, counted behind the command's name; in hundredths of a second.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |k: usize| fields.get(k)?.parse::<f64>().ok();
    Some(0.01 * (ticks(11)? + ticks(12)?))
}

/// The cases, the sets interleaved: a part of the run is a sample of all of them.
fn plan(arguments: &Arguments) -> Vec<(Spec, u32)> {
    let counts = [
        (Set::Single, arguments.singles, 0),
        (Set::Single, arguments.singles_with_current, WITH_CURRENT),
        (Set::Pair, arguments.pairs, 0),
        (Set::Triple, arguments.triples, 0),
        (Set::Nothing, arguments.nothing, 0),
        (Set::Outside, arguments.outside, 0),
    ];
    let cases = counts.into_iter().flat_map(|(set, count, offset)| {
        let spec = Spec {
            rows: arguments.rows,
            evaluation: !arguments.design,
            current: (offset == WITH_CURRENT).then_some(true),
            ..Spec::new(set)
        };
        (0..count).map(move |k| (f64::from(k) / f64::from(count), (spec, offset + arguments.first + k)))
    });
    let mut cases: Vec<(f64, (Spec, u32))> = cases.collect();
    cases.sort_by(|a, b| a.0.total_cmp(&b.0));
    cases.into_iter().map(|case| case.1).collect()
}

fn record(arguments: &Arguments, spec: &Spec, seed: u32) {
    let mut case = draw(spec, seed);
    if arguments.fitted {
        case.model = case.model.replacen("[model]", "[model]\nfitted_to_log = true", 1);
    }
    let line = match analyse(&case) {
        Ok(line) => line,
        Err(error) => return eprintln!("{:?} {seed}: {error:#}", spec.set),
    };
    let wrong = if line.outside.is_some() { line.verdict != "unexplained" } else { !line.right() };
    if arguments.misses && wrong {
        eprintln!("{line:?}");
    }
    let text = serde_json::to_string(&line).expect("a line") + "\n";
    let file = OpenOptions::new().create(true).append(true).open(&arguments.lines);
    file.and_then(|mut file| file.write_all(text.as_bytes())).expect("the file of lines");
}

/// Writes the case, reads it as a user's, analyses it, scores it.
fn analyse(case: &Case) -> Result<Line, Box<dyn std::error::Error>> {
    let Opened { model, log, holdout } = opened(case)?;
    let (started, begin) = (cpu_s(), Instant::now());
    let mut outcome = gap::run(&model, &log, std::slice::from_ref(&holdout), &Options::default(), &|_| ())?;
    outcome.runtime_s = begin.elapsed().as_secs_f64();
    let cpu_s = cpu_s().zip(started).map(|(end, start)| end - start);
    let extended = ModelFile { original: &model.source_text, origin: "log.csv" }.export(&outcome)?;
    let extended = model::parse("extended.toml", &extended)?;
    let avoidable = |model: &Model| avoidable(model, &log, &holdout, case);
    Ok(Line { cpu_s, ..score(&case.answer, &outcome, avoidable(&model), avoidable(&extended)) })
}

/// Rms of what a model predicts for the hold-out minus the noise-free truth, over the noise; `None` if the analysis
/// compares another signal than the logged speed.
fn avoidable(model: &Model, log: &Dynamic, holdout: &Dynamic, case: &Case) -> Option<f64> {
    let bench = prepare(model, log, std::slice::from_ref(holdout)).ok()?;
    let hypothesis = Hypothesis::new(&bench, model, Vec::new());
    let nominal = vec![0.0; hypothesis.slots.len()];
    let made = Prediction::of(&hypothesis, &nominal, &[Part::HoldOut]);
    let (times, omega) = (case.holdout.column("t_s"), case.holdout.column("omega_rad_s"));
    // Rows in order; the analysis may leave some out.
    let mut row = 0;
    let mut pairs = (Vec::new(), Vec::new());
    for (k, &t) in made.time.iter().enumerate() {
        row += times[row..].iter().position(|time| (time - t).abs() < 1e-6)?;
        if (omega[row] - made.measured[k]).abs() > 1e-6 * case.answer.full_speed {
            return None;
        }
        pairs.0.push(made.predicted[k]);
        pairs.1.push(case.noiseless[row]);
        row += 1;
    }
    (!pairs.0.is_empty()).then(|| rms_difference(&pairs.0, &pairs.1) / case.answer.noise_rms)
}

fn score(answer: &Answer, outcome: &Outcome, before: Option<f64>, after: Option<f64>) -> Line {
    Line {
        set: text(serde_json::json!(answer.set)),
        seed: answer.seed,
        hidden: answer.hidden.iter().map(|hidden| (hidden.name.to_owned(), hidden.visibility)).collect(),
        outside: answer.outside.map(str::to_owned),
        current: answer.current_logged,
        dirty: answer.dirty,
        verdict: text(serde_json::json!(outcome.verdict)),
        grade: text(serde_json::json!(outcome.grade)),
        named: outcome.effects.iter().map(|effect| effect.name.clone()).collect(),
        rivals: outcome.ties.iter().flat_map(|tie| tie.rivals.clone()).collect(),
        closest: outcome.closest_known.clone(),
        structure: outcome.unexplained.structure.clone(),
        before,
        after,
        deviations: deviations(answer, outcome),
        shifts: shifts(answer, outcome),
        runtime_s: outcome.runtime_s,
        cpu_s: None,
    }
}

/// (estimate − truth)/std of the shift of every base parameter, in cases whose names are all right.
fn shifts(answer: &Answer, outcome: &Outcome) -> Vec<(String, f64)> {
    if !names_are_right(answer, outcome) {
        return Vec::new();
    }
    let (own, claimed) = (&answer.base, &answer.claimed);
    let truths = [
        ("R_ohm", own.R_ohm / claimed.R_ohm),
        ("L_h", own.L_h / claimed.L_h),
        ("Kt_nm_per_a", own.K_nm_per_a / claimed.K_nm_per_a),
        ("Ke_vs_per_rad", own.K_nm_per_a / claimed.K_nm_per_a),
        ("J_kgm2", own.J_kgm2 / claimed.J_kgm2),
        ("b_nms_per_rad", own.b_nms_per_rad / claimed.b_nms_per_rad),
    ];
    let of = |key: &str| truths.iter().find(|truth| truth.0 == key).map(|truth| 100.0 * (truth.1 - 1.0));
    let told = outcome.within_tolerance.iter().filter(|shift| shift.std_percent > 0.0);
    told.filter_map(|shift| {
        let truth = of(&shift.parameter).filter(|truth| truth.is_finite())?;
        Some((shift.parameter.clone(), (shift.shift_percent - truth) / shift.std_percent))
    })
    .collect()
}
