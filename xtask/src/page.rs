//! The page in the browser: built into `target/page`, served, and checked in Chromium.

use crate::process::{cargo, find, root, run};
use crate::programs::Program;
use crate::setup::{self, BROWSER};
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What to do with the page besides building it.
#[derive(clap::Args)]
pub struct Choice {
    /// Serve it at http://127.0.0.1:8000/ until Ctrl-C.
    #[arg(long)]
    serve: bool,
    /// Drive it in Chromium and compare its answers with those of the command line. Needs node, npm and chromium.
    #[arg(long)]
    check: bool,
}

/// Where the page lies in the project.
const SOURCE: &str = "workbench/page";
/// The rig of the example button, and the files of it that the page shows.
const EXAMPLE: (&str, [&str; 5]) =
    ("data/rigs/frc5409_drive", ["model.toml", "log.csv", "holdout.csv", "README.md", "LICENSE"]);
/// What draws the report's charts.
const CHARTS: [&str; 5] =
    ["style.css", "charts.js", "uplot/uPlot.iife.min.js", "uplot/uPlot.min.css", "uplot/LICENSE"];
/// Two numbers in a register: every browser has it since 2023 (Safari 16.4).
const FLAGS: &str = "-C target-feature=+simd128";
/// The rigs that are compared: ten whose logs lie in their folders, and which take some minutes together.
const RIGS: [&str; 10] = [
    "andromeda_drive",
    "angel_drive",
    "eagle_swerve",
    "frc501_drive",
    "frc5409_drive",
    "laas_acc",
    "spectrum_shooter",
    "thomas_drive",
    "un_map",
    "xl330_pwm",
];
/// What Chromium is called.
const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Builds, and what was chosen.
pub fn page(choice: &Choice) -> Result<()> {
    let page = built()?;
    println!("{}", page.display());
    if choice.check {
        check(&page)?;
    }
    if choice.serve {
        serve(&page)?;
    }
    Ok(())
}

/// The folder of static files, made anew.
fn built() -> Result<PathBuf> {
    setup::rust_target(BROWSER)?;
    let (page, source, bindgen) = (root().join("target/page"), root().join(SOURCE), bindgen()?);
    let manifest = source.join("Cargo.toml");
    let mut build = cargo(&["build", "--release", "--locked", "--target", BROWSER, "--manifest-path"]);
    run(build.arg(&manifest).arg("--target-dir").arg(target()).env("RUSTFLAGS", FLAGS))?;
    if page.exists() {
        fs::remove_dir_all(&page).with_context(|| format!("cannot replace {}", page.display()))?;
    }
    let engine = target().join(BROWSER).join("release/truing_page.wasm");
    let mut bind = Command::new(bindgen);
    bind.args(["--target", "web", "--no-typescript", "--remove-name-section", "--remove-producers-section"]);
    run(bind.arg("--out-dir").arg(&page).arg(engine))?;
    for entry in fs::read_dir(source.join("web"))? {
        let name = entry?.file_name();
        copied(&source.join("web").join(&name), &page.join(name))?;
    }
    let (rig, files) = EXAMPLE;
    files
        .iter()
        .try_for_each(|file| copied(&root().join(rig).join(file), &page.join("example").join(file)))?;
    let report = root().join("workbench/report/src/report");
    let flat = |file: &str| page.join("report").join(Path::new(file).file_name().unwrap_or_default());
    CHARTS.iter().try_for_each(|file| copied(&report.join(file), &flat(file)))?;
    Ok(page)
}

/// Where Cargo builds.
fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

fn copied(from: &Path, to: &Path) -> Result<()> {
    let folder = to.parent().unwrap_or(to);
    fs::create_dir_all(folder)
        .and_then(|()| fs::copy(from, to))
        .map(|_| ())
        .with_context(|| format!("cannot copy {} to {}", from.display(), to.display()))
}

/// The program that writes the JavaScript beside the engine, of the version that the engine was built with.
fn bindgen() -> Result<PathBuf> {
    let version = locked("wasm-bindgen")?;
    let folder = root().join("target/tools").join(format!("wasm-bindgen-{version}"));
    let program = folder.join("bin/wasm-bindgen");
    if !program.is_file() {
        println!("set-up: installing wasm-bindgen-cli {version}");
        let exact = format!("={version}");
        // Unoptimised: it is built longer than it ever runs.
        let mut install = cargo(&["install", "wasm-bindgen-cli", "--debug", "--version", &exact, "--root"]);
        run(install.arg(&folder).env_remove("RUSTFLAGS"))?;
    }
    Ok(program)
}

/// The version of a crate in the page's lock.
fn locked(name: &str) -> Result<String> {
    let path = root().join(SOURCE).join("Cargo.lock");
    let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let lock: toml::Table = text.parse().with_context(|| format!("{} is no lock", path.display()))?;
    let crates = lock.get("package").and_then(|it| it.as_array()).into_iter().flatten();
    let mut named = crates.filter(|it| it.get("name").and_then(|it| it.as_str()) == Some(name));
    let version = named.next().and_then(|it| it.get("version")).and_then(|it| it.as_str());
    version.map(str::to_owned).with_context(|| format!("{} lacks {name}", path.display()))
}

fn serve(page: &Path) -> Result<()> {
    println!("http://127.0.0.1:8000/");
    let mut server = Command::new("python3");
    run(server.args(["-m", "http.server", "--bind", "127.0.0.1", "8000", "--directory"]).arg(page))
}

/// Drives the page as a person would; left out, with a word, where there is no browser.
fn check(page: &Path) -> Result<()> {
    let browser = BROWSERS.iter().find_map(|name| find(name));
    let (Some(browser), Some(_), Some(_)) = (browser, find("node"), find("npm")) else {
        println!(
            "the page is not checked in a browser: node, npm or chromium is missing (apt-get install nodejs npm chromium)"
        );
        return Ok(());
    };
    let (folder, source) = (root().join("target/page-check"), root().join(SOURCE).join("check"));
    for entry in fs::read_dir(&source)? {
        let name = entry?.file_name();
        copied(&source.join(&name), &folder.join(name))?;
    }
    run(Command::new("npm").args(["ci", "--no-audit", "--no-fund"]).current_dir(&folder))?;
    let expected = expected(&folder)?;
    let mut test = Command::new("node");
    test.args(["--test", "--test-concurrency=1", "page.test.mjs"]).current_dir(&folder);
    test.env("PAGE", page).env("RIGS", root().join("data/rigs"));
    run(test.env("EXPECTED", expected).env("CHROMIUM", browser))
}

/// What the command line answers. A rig that is judged wrong is no matter here: the answers are to be the same.
fn expected(folder: &Path) -> Result<PathBuf> {
    let answers = folder.join("expected");
    let mut judge = Program::Truing.run();
    let _ = judge.args(["judge", "data/rigs", "--out"]).arg(&answers).arg("--only").args(RIGS).status()?;
    if let Some(rig) = RIGS.iter().find(|rig| !answers.join(format!("{rig}.json")).is_file()) {
        bail!("`truing judge` has no answer on {rig}");
    }
    Ok(answers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lock_tells_which_wasm_bindgen_is_needed() {
        assert!(locked("wasm-bindgen").unwrap().starts_with("0.2."));
        assert!(locked("no-such-crate").is_err());
    }

    #[test]
    fn the_rigs_of_the_page_hold_their_logs() {
        let file = |rig: &str, file: &str| root().join("data/rigs").join(rig).join(file);
        for rig in RIGS {
            assert!(
                ["model.toml", "log.csv", "holdout.csv"].iter().all(|it| file(rig, it).is_file()),
                "{rig}"
            );
        }
        assert!(EXAMPLE.1.iter().all(|it| root().join(EXAMPLE.0).join(it).is_file()));
    }
}
