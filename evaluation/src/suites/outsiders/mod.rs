//! Evaluation of what the gap workflow says of logs that no name explains:
//! `cargo run -p evaluation -- outsiders --draws 20`.
//!
//! Each kind is drawn from seeds of its own. It must not be given a name, the report must say what the rest depends on, and the
//! term without a name must lower the held-out gap. With `--again` the workflow is run again on the extended model.

mod kinds;
mod motor;
mod rig;

use evaluation::Results;
use kinds::{KINDS, Kind};
use rayon::prelude::*;
use std::error::Error;
use std::time::Instant;
use truing::files::log::{self, Columns, Log};
use truing::gap::{self, Options};
use truing::outcome::{Outcome, Verdict};
use truing::report::{Exporter, model_file::ModelFile};
use truing::system::model::{self, Model};

#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Cases of each kind.
    #[arg(long, default_value_t = 20)]
    draws: u64,
    /// First seed.
    #[arg(long, default_value_t = 1)]
    first: u64,
    /// Use design seeds: to look at single cases while building.
    #[arg(long)]
    design: bool,
    /// Only the kinds whose name contains this.
    #[arg(long, default_value = "")]
    kind: String,
    /// The model files say `fitted_to_log`: where no names reach the noise they go by shares, as on a measured rig.
    #[arg(long)]
    fitted: bool,
    /// Run the workflow again on the extended model: it must find nothing more.
    #[arg(long)]
    again: bool,
    /// Cases at once.
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// Show each case.
    #[arg(long)]
    each: bool,
    #[command(flatten)]
    results: Results,
}

/// Evaluation seeds begin here, apart from the design seeds.
const EVALUATION: u64 = 1 << 40;
/// A share that is large enough to ask for the right variable.
const PREDICTS: f64 = 0.15;

/// What the workflow said of one case.
struct Said {
    verdict: Verdict,
    names: Vec<String>,
    structure: String,
    over: Vec<String>,
    share: f64,
    noise_like: bool,
    /// Held-out gap with the term over that without it; 1 without a term.
    ratio: f64,
    /// Held-out gap of the extended model over that of the model as given.
    overall: f64,
    /// Names and variables that the second run finds.
    again: Vec<String>,
    seconds: f64,
}

impl Said {
    /// True if names are given as the whole answer.
    fn misnamed(&self) -> bool {
        !self.names.is_empty() && self.verdict != Verdict::Unexplained
    }
}

pub fn run(arguments: Arguments) {
    let jobs = rayon::ThreadPoolBuilder::new().num_threads(arguments.jobs).build().expect("threads");
    let mut page = arguments.results.page();
    page.line("```text");
    page.line("kind               misnamed  names  told right/told  noise-like  share  gap with/without: median  worst  again");
    let mut all: Vec<(&Kind, Said)> = Vec::new();
    for kind in KINDS.iter().filter(|kind| kind.name.contains(&arguments.kind)) {
        let said: Vec<Said> = jobs.install(|| cases(&arguments, kind));
        page.line(row(kind.name, kind, &said.iter().collect::<Vec<_>>()));
        all.extend(said.into_iter().map(|said| (kind, said)));
    }
    page.print(summary(&all));
    page.line("```");
    let last = arguments.first + arguments.draws - 1;
    let seeds = if arguments.design { "design" } else { "evaluation" };
    page.close(&format!("{seeds} {} to {last} of each kind", arguments.first));
}

fn cases(arguments: &Arguments, kind: &Kind) -> Vec<Said> {
    let offset = if arguments.design { 0 } else { EVALUATION };
    let place = KINDS.iter().position(|other| other.name == kind.name).unwrap_or(0) as u64;
    let seeds = arguments.first..arguments.first + arguments.draws;
    let case = |seed: u64| match said(arguments, kind, offset + (place << 32) + seed) {
        Ok(said) => {
            if arguments.each {
                eprintln!(
                    "{} {seed}: {:?} {:?} {:?} {:.2} \"{}\" noise {} ratio {:.3} overall {:.3} again {:?} {:.1} s",
                    kind.name,
                    said.verdict,
                    said.names,
                    said.over,
                    said.share,
                    said.structure,
                    said.noise_like,
                    said.ratio,
                    said.overall,
                    said.again,
                    said.seconds
                );
            }
            Some(said)
        }
        Err(error) => {
            eprintln!("{} {seed}: {error:#}", kind.name);
            None
        }
    };
    seeds.into_par_iter().filter_map(case).collect()
}

/// Writes a case, reads it as a user's, analyses it, and analyses it again with the extended model.
fn said(arguments: &Arguments, kind: &Kind, seed: u64) -> Result<Said, Box<dyn Error>> {
    let mut case = rig::draw(kind, seed);
    if arguments.fitted {
        case.model = case.model.replacen("[model]", "[model]\nfitted_to_log = true", 1);
    }
    let given = model::parse("model.toml", &case.model)?;
    let (log, holdout) = (record("log.csv", &case.log)?, record("holdout.csv", &case.holdout)?);
    let run =
        |model: &Model| gap::run(model, &log, std::slice::from_ref(&holdout), &Options::default(), &|_| ());
    let started = Instant::now();
    let outcome = run(&given)?;
    let seconds = started.elapsed().as_secs_f64();
    let extended = ModelFile { original: &given.source_text, origin: "log.csv" }.export(&outcome)?;
    let left = &outcome.unexplained;
    let again = match &left.unnamed {
        Some(_) if arguments.again => found(&run(&model::parse("extended.toml", &extended)?)?),
        _ => Vec::new(),
    };
    Ok(Said {
        verdict: outcome.verdict,
        structure: left.structure.clone(),
        names: outcome.effects.iter().map(|effect| effect.name.clone()).collect(),
        over: left.depends_on.iter().map(|it| (*it).to_owned()).collect(),
        share: left.predicts_share.unwrap_or(0.0),
        noise_like: left.noise_like == Some(true),
        ratio: left.unnamed.as_ref().map_or(1.0, |term| term.gap_after / term.gap_before),
        overall: outcome.holdout.rmse_after / outcome.holdout.rmse_before,
        again,
        seconds,
    })
}

/// What a run adds to its model.
fn found(outcome: &Outcome) -> Vec<String> {
    let terms = outcome.unexplained.unnamed.iter().map(|term| term.over.join(" and "));
    outcome.effects.iter().map(|effect| effect.name.clone()).chain(terms).collect()
}

fn record(name: &str, text: &str) -> Result<Log, Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("outsiders-{}-{name}", std::process::id()));
    let path = folder.with_extension(format!("{:?}.csv", std::thread::current().id()));
    std::fs::write(&path, text)?;
    let read = log::read(&path, &"".parse::<Columns>()?);
    std::fs::remove_file(&path)?;
    Ok(read?)
}

fn right(kind: &Kind, said: &Said) -> bool {
    said.over.iter().any(|it| kind.right.contains(&it.as_str()))
}

fn row(name: &str, kind: &Kind, said: &[&Said]) -> String {
    let count = |is: &dyn Fn(&Said) -> bool| said.iter().filter(|said| is(said)).count();
    let told = |said: &Said| !said.over.is_empty();
    let mut ratios: Vec<f64> = said.iter().map(|said| said.ratio).collect();
    let mut shares: Vec<f64> = said.iter().map(|said| said.share).collect();
    format!(
        "{name:19} {:>3}  {:>3}/{:<3}  {:>6}/{:<8}  {:>10}  {:>5.2}  {:>24.2}  {:>5.2}  {:>5}",
        count(&Said::misnamed),
        count(&|said| !said.names.is_empty()),
        said.len(),
        count(&|said| right(kind, said)),
        count(&told),
        count(&|said| said.noise_like),
        median(&mut shares),
        median(&mut ratios),
        ratios.iter().copied().fold(0.0, f64::max),
        count(&|said| !said.again.is_empty()),
    )
}

fn summary(all: &[(&Kind, Said)]) -> String {
    let known = || all.iter().filter(|(kind, _)| !kind.right.is_empty());
    let asked: Vec<_> = known().filter(|(_, said)| said.share >= PREDICTS || said.over.is_empty()).collect();
    let mut ratios: Vec<f64> = known().map(|(_, said)| said.ratio).collect();
    let mut overall: Vec<f64> = known().map(|(_, said)| said.overall).collect();
    let mut seconds: Vec<f64> = all.iter().map(|(_, said)| said.seconds).collect();
    let misnamed = all.iter().filter(|(_, said)| said.misnamed()).count();
    let beside = all.iter().filter(|(_, said)| !said.misnamed() && !said.names.is_empty()).count();
    let noise = all.iter().filter(|(kind, said)| kind.right.is_empty() && !said.over.is_empty()).count();
    let part = |count: usize, of: usize| 100.0 * count as f64 / of.max(1) as f64;
    let told_right = asked.iter().filter(|(kind, said)| right(kind, said)).count();
    format!(
        "misnamed (a name, and nothing said to be left): {misnamed} of {} ({:.1} %)\nnames beside what is said to be left: {beside}\nvariable told right: {told_right} of {} ({:.0} %), where one predicts 15 % or none is told\n\
         noise that is told to depend on something: {noise}\nheld-out gap with the term over without it: median {:.2}, worst {:.3}\n\
         held-out gap of the extended model over the model as given: median {:.2}, worst {:.3}\n\
         wall time of a case: median {:.1} s, worst {:.1} s\n",
        all.len(),
        part(misnamed, all.len()),
        asked.len(),
        part(told_right, asked.len()),
        median(&mut ratios),
        ratios.iter().copied().fold(0.0, f64::max),
        median(&mut overall),
        overall.iter().copied().fold(0.0, f64::max),
        median(&mut seconds),
        seconds.iter().copied().fold(0.0, f64::max),
    )
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
