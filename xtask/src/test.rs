//! Every test, in the order in which a person wants to hear of a failure: cheap and local first.

use crate::documents;
use crate::image::{self, Boards, Image};
use crate::process::{cargo, root, run, text};
use crate::programs::{self, Program};
use crate::setup;
use crate::steps::{self, Steps};
use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

/// Runs them and closes with the count of passed and skipped tests; with `all` the long proofs whole.
pub fn everything(all: bool) -> Result<()> {
    let mut steps = Steps::begin();
    let boards = if all { Boards::All } else { Boards::Two };
    let selections = selections();
    // probe-rs takes a minute to be looked at, for two hundred lines.
    let looked_at = if all { &selections[..] } else { &selections[..1] };
    steps.next("set-up");
    setup::everything()?;
    steps.next("formatting");
    run(&mut cargo(&["fmt", "--all", "--check"]))?;
    steps.next("lints, host");
    for selection in looked_at {
        let mut clippy = cargo(&["clippy", "--all-targets"]);
        run(clippy.args(selection).args(["--", "-D", "warnings"]))?;
    }
    for board in Boards::All.list() {
        let mut clippy = Image::of(board).command("clippy");
        clippy.args(["--", "-D", "warnings"]);
        steps.next(&format!("lints, image for {}", board.name));
        run(&mut clippy)?;
    }
    steps.next("lints, an axis inside of somebody else's firmware");
    run(image::example("clippy", "in_your_firmware").args(["--", "-D", "warnings"]))?;
    steps.next("lints, our parts beside published crates");
    run(image::bench("clippy").args(["--", "-D", "warnings"]))?;
    steps.next("the engine in a browser");
    run(&mut programs::engine_check(setup::BROWSER))?;
    steps.next("packages");
    crate::dist::packages()?;
    if all {
        steps.next("the fuzzer of the link");
        let fuzzer =
            cargo(&["check", "--manifest-path", "tools/fuzz/Cargo.toml", "--target-dir", "target/fuzz"]);
        run(&mut { fuzzer })?;
    }
    steps.next("documentation");
    let packed = programs::packed();
    for selection in if all { looked_at } else { std::slice::from_ref(&packed) } {
        let mut doc = cargo(&["doc", "--no-deps"]);
        run(doc.args(selection).env("RUSTDOCFLAGS", "-D warnings"))?;
    }
    steps.next("images");
    crate::size::images(boards)?;
    steps.next("size and instructions against docs/cost.toml, ways to a panic");
    crate::size::print(boards, false)?;
    crate::instructions::print(false)?;
    crate::panics::check(boards, true)?;
    steps.next("work of the search against docs/cost.toml");
    crate::search::print(false)?;
    let tally = host_tests(&mut steps, all)?;
    // What was built until here is used from here on.
    steps.next("the boards' images and their chips' memory maps");
    crate::flash::dry_runs(boards)?;
    steps.next("our parts beside published crates");
    crate::bench::print()?;
    steps.next("commands that README and documents show");
    // With the tests named, features are those that the tests were built with: nothing is built a second time.
    run(cargo(&["build", "--bins", "--tests"]).args(&selections[0]))?;
    documents::check_arguments()?;
    steps.next("the command line, installed from this checkout");
    crate::dist::install()?;
    steps.close();
    tally.close();
    steps::mark_green()
}

/// Reason under which tests are counted that the runner leaves out by attribute. The project has none; should one come,
/// the closing line says so instead of hiding it.
const BY_ATTRIBUTE: &str = "marked #[ignore]";

/// What the test runner reported.
#[derive(Default)]
struct Tally {
    passed: usize,
    failed: usize,
    /// Reason of a skip → how often.
    skipped: BTreeMap<String, usize>,
}

/// `cargo test` over the workspace: unit, numeric, closed-loop, command-line and QEMU tests.
fn host_tests(steps: &mut Steps, all: bool) -> Result<Tally> {
    steps.next("tests, built");
    for what in selections() {
        run(cargo(&["test", "--no-run"]).args(&what))?;
    }
    steps.next("tests on the host and in QEMU");
    let skip_log = root().join("target").join("skipped-tests.txt");
    std::fs::write(&skip_log, "").with_context(|| format!("cannot write {}", skip_log.display()))?;
    let mut tally = Tally::default();
    let mut well = true;
    for what in selections() {
        well &= tests(&what, &skip_log, &mut tally, all)?;
    }
    tally.read_skips(&skip_log)?;
    if !well || tally.failed > 0 {
        bail!("{} tests failed, {} passed", tally.failed, tally.passed);
    }
    if tally.passed == 0 {
        bail!("no test ran");
    }
    Ok(tally)
}

/// The packages in two selections. What probe-rs asks of common crates would otherwise have them, and the workbench with
/// them, built a second time for whatever is started by its package. (Cargo unites the features of what it builds at once.)
fn selections() -> [Vec<&'static str>; 2] {
    let apart = Program::FlashDryRun.package();
    [vec!["--workspace", "--exclude", apart], vec!["-p", apart]]
}

/// Runs the tests of a selection and counts them; `false` if the runner failed.
fn tests(selection: &[&str], skip_log: &Path, tally: &mut Tally, all: bool) -> Result<bool> {
    let mut command = cargo(&["test", "--no-fail-fast"]);
    command
        .args(selection)
        .env("TRUING_SKIP_LOG", skip_log)
        .env("TRUING_REQUIRE_QEMU", "1")
        .stdout(Stdio::piped());
    if all {
        command.env("TRUING_ALL", "1");
    }
    let mut child = command.spawn().with_context(|| format!("cannot start `{}`", text(&command)))?;
    for line in BufReader::new(child.stdout.take().expect("piped")).lines() {
        let line = line.context("the output of `cargo test` is not text")?;
        println!("{line}");
        tally.count(&line);
    }
    Ok(child.wait()?.success())
}

impl Tally {
    /// Adds a line such as `test result: ok. 12 passed; 0 failed; 1 ignored; …`.
    fn count(&mut self, line: &str) {
        let Some(counts) = line.strip_prefix("test result: ") else {
            return;
        };
        for part in counts.split([';', '.']) {
            let mut words = part.split_whitespace();
            let (Some(number), Some(what)) =
                (words.next().and_then(|word| word.parse::<usize>().ok()), words.next())
            else {
                continue;
            };
            match what {
                "passed" => self.passed += number,
                "failed" => self.failed += number,
                "ignored" if number > 0 => *self.skipped.entry(BY_ATTRIBUTE.into()).or_default() += number,
                _ => {}
            }
        }
    }

    /// A skipped test returns early, so the runner counted it as passed: it is moved to the skipped ones.
    fn read_skips(&mut self, log: &Path) -> Result<()> {
        let text = std::fs::read_to_string(log).with_context(|| format!("cannot read {}", log.display()))?;
        let by_test: BTreeMap<&str, &str> = text.lines().filter_map(|line| line.split_once('\t')).collect();
        for reason in by_test.into_values() {
            *self.skipped.entry(reason.to_string()).or_default() += 1;
            self.passed = self.passed.saturating_sub(1);
        }
        Ok(())
    }

    fn close(&self) {
        let skipped: usize = self.skipped.values().sum();
        let reasons =
            self.skipped.iter().map(|(reason, times)| format!("{times} × {reason}")).collect::<Vec<_>>();
        println!("{} passed, {} failed, {skipped} skipped", self.passed, self.failed);
        let why = if reasons.is_empty() { "nothing left out".to_string() } else { reasons.join("; ") };
        println!("{} passed, {skipped} skipped ({why})", self.passed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_runner_s_closing_lines_add_up() {
        let mut tally = Tally::default();
        tally.count(
            "test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.1s",
        );
        tally.count("test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out");
        tally.count("running 5 tests");
        assert_eq!((tally.passed, tally.failed), (15, 2));
        assert_eq!(tally.skipped, BTreeMap::from([(BY_ATTRIBUTE.to_string(), 1)]));
    }

    #[test]
    fn a_test_that_skips_twice_counts_as_one_skip_and_not_as_passed() {
        let log = std::env::temp_dir().join(format!("truing-skips-{}", std::process::id()));
        std::fs::write(&log, "fits_emps\tno EMPS\nfits_emps\tno EMPS\nfits_mouse\tno mouse\n").unwrap();
        let mut tally = Tally { passed: 10, ..Tally::default() };
        tally.read_skips(&log).unwrap();
        std::fs::remove_file(&log).unwrap();
        assert_eq!(tally.passed, 8);
        assert_eq!(tally.skipped.values().sum::<usize>(), 2);
    }
}
