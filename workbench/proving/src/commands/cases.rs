//! `truing cases`: data in which an effect is hidden, the answers elsewhere.

use crate::synthetic::cases::{Case, Set, Spec, draw};
use anyhow::{Context, ensure};
use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};
use truing_report::report::write_atomically;

/// Draws hidden cases: each a model file, a log and a hold-out, with the answer in another folder.
#[derive(Args, Debug)]
pub struct Arguments {
    /// What is hidden.
    #[arg(long, value_enum, default_value = "single")]
    set: Set,
    /// Number of cases.
    #[arg(long, default_value_t = 10, value_parser = at_least_one::<u32>)]
    count: u32,
    /// Seed of the first case; the others follow.
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// Rows of log and hold-out.
    #[arg(long, default_value_t = 3000)]
    rows: usize,
    /// Log the current in every case (without: in three of ten).
    #[arg(long)]
    current: bool,
    /// Use the seeds that are kept for evaluation.
    #[arg(long)]
    evaluation: bool,
    /// Folder for the cases, one folder each.
    #[arg(long)]
    out: PathBuf,
    /// Folder for the answers; must not lie inside `--out`, where the analysis reads.
    #[arg(long)]
    answers: PathBuf,
}

/// Draws and writes.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    ensure!(arguments.rows >= 600, "--rows {}: at least 600 are needed for one protocol", arguments.rows);
    apart(&arguments.out, &arguments.answers)?;
    let (out, answers) = (folder(&arguments.out)?, folder(&arguments.answers)?);
    // Links show where they lead only once both folders exist.
    apart(&out, &answers)?;
    let spec = Spec {
        rows: arguments.rows,
        current: arguments.current.then_some(true),
        evaluation: arguments.evaluation,
        ..Spec::new(arguments.set)
    };
    for seed in arguments.seed..arguments.seed.saturating_add(arguments.count) {
        // The name tells the seed, not what is hidden.
        let name = format!("case-{seed:05}");
        write(&draw(&spec, seed), &out.join(&name), &answers, &name)
            .with_context(|| format!("{}: cannot be written", out.join(&name).display()))?;
    }
    outln!("{} cases in {}, answers in {}", arguments.count, out.display(), answers.display());
    Ok(())
}

fn apart(out: &Path, answers: &Path) -> anyhow::Result<()> {
    ensure!(
        !answers.starts_with(out),
        "--answers {}: lies inside --out, where the analysis reads; name another folder",
        answers.display()
    );
    Ok(())
}

fn folder(path: &Path) -> anyhow::Result<PathBuf> {
    fs::create_dir_all(path)
        .and_then(|()| path.canonicalize())
        .with_context(|| format!("{}: cannot be made a folder", path.display()))
}

/// Writes one case into `folder` and its answer into `answers`.
pub fn write(case: &Case, folder: &Path, answers: &Path, name: &str) -> anyhow::Result<()> {
    write_atomically(&folder.join("model.toml"), &case.model)?;
    write_atomically(&folder.join("log.csv"), &case.log.to_csv())?;
    write_atomically(&folder.join("holdout.csv"), &case.holdout.to_csv())?;
    write_atomically(&answers.join(format!("{name}.json")), &serde_json::to_string_pretty(&case.answer)?)
}

/// A whole number above 0.
fn at_least_one<N: std::str::FromStr + Default + PartialEq>(text: &str) -> Result<N, String> {
    let number = text.parse().ok().filter(|number| *number != N::default());
    number.ok_or_else(|| "write a whole number, at least 1".into())
}
