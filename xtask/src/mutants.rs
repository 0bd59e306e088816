//! Mutants of drivers, protection and image: small changes to the code, each of which some test should notice.
//!
//! `cargo-mutants` makes them in a copy of the project. Each is tried with the narrow room of `tools/mutants`, which knows no
//! workbench: first without the model of the chip, which takes a second, then, if nothing was noticed, with it. What protection
//! concludes from a motor is judged by closed loops alone: for its mutants they come last, and take minutes each.

use crate::process::{cargo, find, root, run};
use crate::programs::{self, Judge};
use anyhow::{Context, Result, bail};
use clap::Args;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::process::Command;

/// What is left with its reason.
const ACCEPTED: &str = "tools/mutants/accepted.txt";
/// Files that the narrow room compiles.
const FILES: [&str; 12] = [
    "src/drivers/*.rs",
    "src/protect/**/*.rs",
    "**/image/tick.rs",
    "**/image/boot.rs",
    "**/image/../image/board/stm32f405/axis.rs",
    "**/image/../image/board/stm32f405/clock.rs",
    "**/image/../image/board/stm32f405/converter.rs",
    "**/image/../image/board/stm32f405/drive.rs",
    "**/image/../image/board/stm32f405/gates.rs",
    "**/image/../image/board/stm32f405/gpio.rs",
    "**/image/../image/board/stm32f405/pwm.rs",
    "**/image/../image/board/stm32f405/timing.rs",
];
/// Their tests are other rooms': power cuts of the store, and the library that it stands on.
const OTHERS: [&str; 3] = ["src/drivers/flash.rs", "src/drivers/page.rs", "src/drivers/newest.rs"];
/// Tests that look at documents.
const DOCUMENTS: [&str; 3] = ["documentation", "pages_of_boards", "the_picture"];

/// The first test that fails is enough: the others would take minutes.
const FAIL_FAST: [&str; 3] = ["-Z", "unstable-options", "--fail-fast"];

/// Tests that mutants are tried with.
struct Room {
    /// Where its results lie, in `target/mutants-out`.
    folder: &'static str,
    judge: Judge,
    /// Tests of these names are left out.
    skipped: &'static [&'static str],
    /// Beginnings of the names of files that it is for.
    files: &'static str,
    profile: &'static str,
    /// Seconds after which a mutant counts as noticed: it hangs.
    patience: &'static str,
}

const QUICK: Room = Room {
    folder: "quick",
    judge: Judge::Narrow,
    skipped: &["board_model"],
    files: "src/",
    profile: "mutants",
    patience: "180",
};

/// One behind the other: each for what the one before it has not noticed.
const ROOMS: [Room; 3] = [
    QUICK,
    Room { folder: "model", skipped: &[], profile: "dev", patience: "900", ..QUICK },
    Room {
        folder: "loops",
        judge: Judge::ClosedLoops,
        skipped: &[],
        files: "src/protect/",
        profile: "dev",
        patience: "1800",
    },
];

/// Which mutants.
#[derive(Args)]
pub struct Choice {
    /// Only so many, drawn by the seed.
    #[arg(long)]
    sample: Option<usize>,
    /// Of the sample.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only those whose name matches this, for example `drivers/zero`.
    #[arg(long)]
    only: Option<String>,
    /// Part K of N, as `K/N`, counted from 0.
    #[arg(long)]
    shard: Option<String>,
}

/// Tries them; fails on one that nothing notices and nobody has accepted.
pub fn check(choice: &Choice) -> Result<()> {
    install()?;
    let chosen = names(choice)?;
    run(QUICK.judge.test(QUICK.profile).args(filters(QUICK.skipped)))
        .context("without a mutant the narrow room must be green")?;
    println!("{} mutants", chosen.len());
    let missed = ROOMS.iter().try_fold(chosen, |names, room| room.tried(names))?;
    report(QUICK.count()?, &missed)
}

fn install() -> Result<()> {
    if find("cargo-mutants").is_some() {
        return Ok(());
    }
    println!("set-up: installing cargo-mutants");
    run(&mut cargo(&["install", "cargo-mutants", "--locked"]))
        .context("type `cargo install cargo-mutants --locked` and see what it says")
}

fn mutants() -> Command {
    let mut command = programs::mutants();
    for file in FILES {
        command.args(["--file", file]);
    }
    for file in OTHERS {
        command.args(["--exclude", file]);
    }
    command
}

/// Names of the mutants that were asked for.
fn names(choice: &Choice) -> Result<Vec<String>> {
    let mut list = mutants();
    list.arg("--list");
    list.args(choice.only.iter().flat_map(|pattern| ["--re", pattern]));
    list.args(choice.shard.iter().flat_map(|shard| ["--shard", shard]));
    let output = list.output().context("`cargo mutants` cannot be started")?;
    if !output.status.success() {
        bail!("`cargo mutants --list`: {}", String::from_utf8_lossy(&output.stderr));
    }
    let mut names: Vec<String> = String::from_utf8_lossy(&output.stdout).lines().map(String::from).collect();
    if let Some(most) = choice.sample {
        names.sort_by_key(|name| rank(choice.seed, name));
        names.truncate(most);
    }
    Ok(names)
}

/// Where a mutant stands in the order of a seed, wherever it stands in its file.
fn rank(seed: u64, name: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    (seed, place_free(name)).hash(&mut hasher);
    hasher.finish()
}

/// A name without line and column: `src/x.rs: replace …`.
fn place_free(name: &str) -> String {
    let mut parts = name.splitn(4, ':');
    match (parts.next(), parts.next(), parts.next(), parts.next()) {
        (Some(file), Some(_), Some(_), Some(what)) => format!("{file}:{what}"),
        _ => name.to_string(),
    }
}

impl Room {
    /// Tries those that it is for: all that nothing has noticed.
    fn tried(&self, names: Vec<String>) -> Result<Vec<String>> {
        let (own, mut others): (Vec<_>, Vec<_>) =
            names.into_iter().partition(|name| name.starts_with(self.files));
        if !own.is_empty() {
            others.extend(self.missed(&own)?);
        }
        Ok(others)
    }

    fn missed(&self, names: &[String]) -> Result<Vec<String>> {
        let (package, test) = self.judge.names();
        let output = root().join("target/mutants-out").join(self.folder);
        std::fs::create_dir_all(&output)?;
        let mut command = mutants();
        command.arg("--output").arg(&output);
        // Published crates are built once, not for every copy; and not where the project's own builds would take a mutant for theirs.
        command.env("CARGO_TARGET_DIR", root().join("target/mutants-build"));
        // `cargo-mutants` would take its base line from the packages that it changes.
        command.args(["--test-package", package, "--profile", self.profile, "--baseline", "skip"]);
        command.args(["--timeout", self.patience, "--no-shuffle", "--colors", "never"]);
        for name in names {
            command.args(["--re", &format!("^{}$", escaped(name))]);
        }
        command.args(["--", "--test", test]).args(filters(self.skipped)).args(FAIL_FAST);
        // Lets a stable test binary take options that are not stable, and keeps the compiler as it is.
        command.env("RUSTC_BOOTSTRAP", "-1");
        // 2 and 3: some were not noticed, or hung.
        let status = command.status().context("`cargo mutants` cannot be started")?;
        if !matches!(status.code(), Some(0 | 2 | 3)) {
            bail!("`cargo mutants` failed ({status})");
        }
        self.lines("missed")
    }

    /// Mutants that it has tried. Some more than were asked for: `cargo-mutants` adds those without a field of a structure. One
    /// that does not compile is none.
    fn count(&self) -> Result<usize> {
        ["caught", "missed", "timeout"].iter().map(|name| Ok(self.lines(name)?.len())).sum()
    }

    fn lines(&self, name: &str) -> Result<Vec<String>> {
        let path = root().join(format!("target/mutants-out/{}/mutants.out/{name}.txt", self.folder));
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        Ok(text.lines().map(String::from).collect())
    }
}

/// Arguments of the test room, without tests of these names.
fn filters<'a>(skipped: &'a [&'a str]) -> impl Iterator<Item = &'a str> {
    let names = DOCUMENTS.iter().chain(skipped);
    std::iter::once("--").chain(names.flat_map(|name| ["--skip", name]))
}

/// As a regular expression. `\\<` would be the beginning of a word.
fn escaped(name: &str) -> String {
    let special = |letter: char| r"\.+*?()|[]{}^$#&-~".contains(letter);
    name.chars().flat_map(|letter| special(letter).then_some('\\').into_iter().chain([letter])).collect()
}

fn report(tried: usize, missed: &[String]) -> Result<()> {
    let accepted = std::fs::read_to_string(root().join(ACCEPTED)).context(ACCEPTED)?;
    let accepted: Vec<(&str, &str)> = accepted.lines().filter_map(|line| line.split_once(" | ")).collect();
    let mut open = 0;
    for name in missed {
        let reason = accepted.iter().find(|(pattern, _)| matches(pattern, &place_free(name)));
        open += usize::from(reason.is_none());
        println!("not noticed: {name}\n             {}", reason.map_or("NO REASON", |(_, reason)| reason));
    }
    let share = 100.0 * missed.len() as f64 / tried.max(1) as f64;
    println!("{} of {tried} mutants are not noticed ({share:.1} %), {open} without a reason", missed.len());
    if open > 0 {
        bail!("write a test, or the reason into {ACCEPTED}");
    }
    Ok(())
}

/// A `*` at the end stands for anything.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(beginning) => name.starts_with(beginning),
        None => name == pattern,
    }
}
