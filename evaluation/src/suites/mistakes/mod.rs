//! Mistakes in files: `cargo run -p evaluation -- mistakes --draws 3` and `--right 2000`.
//!
//! Each kind of mistake is made in a log, a held-out record or a model file of three motors: one from which nothing is missing, one with a
//! dead zone, one with dry friction behind a gear. The workflow must name the cause or refuse the file with a clear error; it must
//! never give a false physical name. Half of the kinds were not looked at while the examination was built. With `--right` the drawn
//! cases, in which no file is wrong, are examined: none may be accused.

mod kinds;
mod rig;

use evaluation::Results;
use kinds::{KINDS, Kind};
use rayon::prelude::*;
use rig::Files;
use truing::gap::{self, Options, examine};
use truing::outcome::{Outcome, Verdict};
use truing::synthetic::cases::{Set, Spec, draw};
use truing::system::log::{self, Columns, Log};
use truing::system::model;

#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Motors of each of the three families for each kind.
    #[arg(long, default_value_t = 1)]
    draws: u64,
    /// First seed.
    #[arg(long, default_value_t = 1)]
    first: u64,
    /// Only kinds that were looked at while building.
    #[arg(long)]
    design: bool,
    /// Only kinds whose name contains this.
    #[arg(long, default_value = "")]
    kind: String,
    /// Drawn cases without a mistake that are examined instead.
    #[arg(long, default_value_t = 0)]
    right: u32,
    /// Show each case that was not answered rightly.
    #[arg(long)]
    misses: bool,
    #[command(flatten)]
    results: Results,
}

/// How a case was answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    /// The cause is named, or the file is refused with its place.
    Cause,
    /// The mistake does no harm, and the answer is right all the same.
    Harmless,
    /// Neither the cause nor a false name.
    Silent,
    /// A physical effect is named that is not there.
    FalseName,
}

pub fn run(arguments: Arguments) {
    if arguments.right > 0 {
        return right_files(&arguments);
    }
    let mut page = arguments.results.page();
    page.line("| kind | seen while building | cause or clear error | harmless | silent | false name |\n|---|---|---|---|---|---|");
    let chosen = KINDS.iter().filter(|kind| kind.name.contains(&arguments.kind));
    let chosen: Vec<&Kind> = chosen.filter(|kind| kind.design || !arguments.design).collect();
    let mut sums = [[0usize; 4]; 2];
    for kind in &chosen {
        let cases: Vec<(u64, usize)> = (arguments.first..arguments.first + arguments.draws)
            .flat_map(|seed| (0..rig::FAMILIES).map(move |family| (seed, family)))
            .collect();
        let answers: Vec<(Answer, String)> =
            cases.par_iter().map(|(seed, family)| asked(kind, *seed, *family)).collect();
        if arguments.misses {
            let wrong = |it: &&(Answer, String)| matches!(it.0, Answer::Silent | Answer::FalseName);
            answers.iter().filter(wrong).for_each(|it| eprintln!("{}: {:?}: {}", kind.name, it.0, it.1));
        }
        let count = |which: Answer| answers.iter().filter(|it| it.0 == which).count();
        let row = [Answer::Cause, Answer::Harmless, Answer::Silent, Answer::FalseName].map(count);
        for (sum, own) in sums[usize::from(kind.design)].iter_mut().zip(row) {
            *sum += own;
        }
        let seen = if kind.design { "yes" } else { "no" };
        page.line(format!("| {} | {seen} | {} | {} | {} | {} |", kind.name, row[0], row[1], row[2], row[3]));
    }
    for (name, [cause, harmless, silent, named]) in
        [("**kinds kept apart**", sums[0]), ("**kinds seen**", sums[1])]
    {
        page.line(format!("| {name} | | {cause} | {harmless} | {silent} | {named} |"));
    }
    page.close(&format!("{} … {}", arguments.first, arguments.first + arguments.draws - 1));
}

/// Makes the mistake, asks, and judges the answer.
fn asked(kind: &Kind, seed: u64, family: usize) -> (Answer, String) {
    let mut files = rig::draw(seed, family);
    (kind.make)(&mut files);
    match answer(&files) {
        Err(text) if kind.words.iter().chain(&["line"]).any(|word| text.contains(word)) => {
            (Answer::Cause, text)
        }
        Err(text) => (Answer::Silent, text),
        Ok(outcome) => judged(kind, &files, &outcome),
    }
}

fn judged(kind: &Kind, files: &Files, outcome: &Outcome) -> (Answer, String) {
    let names: Vec<&str> = outcome.effects.iter().map(|effect| effect.name.as_str()).collect();
    let faults: Vec<&str> = outcome.data.iter().map(|fault| fault.what.as_str()).collect();
    let text =
        format!("family {}: {:?} {names:?} {faults:?} {:?}", files.family, outcome.verdict, outcome.notes);
    let told = outcome.data.iter().any(|fault| {
        let text = format!("{} {} {}", fault.place, fault.what, fault.remedy);
        kind.words.iter().any(|word| text.contains(word))
    });
    let noted = outcome.notes.iter().any(|note| kind.notes.iter().any(|word| note.contains(word)));
    let right = names == files.truth() && !matches!(outcome.verdict, Verdict::Data | Verdict::Unexplained);
    let answer = match (told || noted, right) {
        (true, _) => Answer::Cause,
        (_, true) => Answer::Harmless,
        _ if names.iter().any(|name| !files.truth().contains(name))
            && outcome.verdict != Verdict::Unexplained =>
        {
            Answer::FalseName
        }
        _ => Answer::Silent,
    };
    (answer, text)
}

fn answer(files: &Files) -> Result<Outcome, String> {
    let model = model::parse("motor.toml", &files.model_text()).map_err(|error| error.to_string())?;
    let columns = Columns::default();
    let read =
        |name: &str, text: String| log::parse(name, &text, &columns).map_err(|error| error.to_string());
    let log = read("log.csv", files.log_text())?;
    let holdout = read("holdout.csv", files.holdout_text())?;
    let elsewhere = examine::faults(&model, &log, &[]).iter().any(|fault| fault.place != "t_s");
    if let (Log::Dynamic(record), false) = (&log, elsewhere) {
        gap::time_base::check(&model, record, &columns).map_err(|error| error.to_string())?;
    }
    gap::run(&model, &log, &[holdout], &Options::default(), &|_| ()).map_err(|error| error.to_string())
}

/// Examines drawn cases in which nothing is wrong.
fn right_files(arguments: &Arguments) {
    let mut page = arguments.results.page();
    let sets = [Set::Single, Set::Pair, Set::Triple, Set::Nothing, Set::Outside];
    let cases: Vec<(Set, u32)> = (0..arguments.right)
        .map(|k| (sets[k as usize % sets.len()], arguments.first as u32 + k / sets.len() as u32))
        .collect();
    let accused: Vec<String> = cases
        .par_iter()
        .filter_map(|(set, seed)| {
            let case = draw(&Spec { evaluation: true, ..Spec::new(*set) }, *seed);
            let fitted = case.model.replacen("[model]", "[model]\nfitted_to_log = true", 1);
            let text = if seed % 2 == 0 { &case.model } else { &fitted };
            let model = model::parse("model.toml", text).expect("a drawn model");
            let record = |text: &str| log::parse("log.csv", text, &Columns::default()).expect("a drawn log");
            let (log, holdout) = (record(&case.log.to_csv()), record(&case.holdout.to_csv()));
            let faults = examine::faults(&model, &log, &[holdout]);
            let hidden = format!("{:?}", case.answer);
            (!faults.is_empty())
                .then(|| format!("- {set:?} {seed}: {:?} — {}", faults, &hidden[..hidden.len().min(300)]))
        })
        .collect();
    page.line(format!("{} of {} files in which nothing is wrong are accused.", accused.len(), cases.len()));
    accused.iter().for_each(|line| page.line(line));
    page.close(&format!("from {}", arguments.first));
}
