//! The programs of the workspace that `xtask` starts. Their packages are named here and nowhere else, and a test compares
//! the names with what Cargo knows.

use crate::process::{cargo, root, run};
use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use std::path::{Path, PathBuf};
use std::process::Command;

/// One program. `ValueEnum` lists all of them for the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Program {
    /// The workbench.
    Truing,
    /// The suites of the measured tables; one of them starts the next program.
    Evaluation,
    /// What the program above runs on the chip.
    BenchOnChip,
    /// Would the image run on the chip?
    FlashDryRun,
    /// Ways to a panic in an image.
    PanicPaths,
    /// Depth of an image's stack.
    StackDepth,
    /// Figures of the code base.
    House,
    /// The firmware image.
    Firmware,
}

impl Program {
    /// Package and name of the program.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Program::Truing => ("truing", "truing"),
            Program::Evaluation => ("evaluation", "evaluation"),
            Program::BenchOnChip => ("bench-image", "bench-image"),
            // In packages of their own: probe-rs takes a minute to build, and only panic-paths reads debug information.
            Program::FlashDryRun => ("flash-dry-run", "flash-dry-run"),
            Program::PanicPaths => ("panic-paths", "panic-paths"),
            Program::StackDepth => ("panic-paths", "stack-depth"),
            Program::House => ("house", "house"),
            Program::Firmware => ("firmware", "firmware"),
        }
    }

    /// Name of the package.
    pub fn package(self) -> &'static str {
        self.names().0
    }

    /// `cargo run` up to the program's own arguments, without Cargo's words.
    pub fn run(self) -> Command {
        let mut command = self.cargo("run");
        command.args(["--quiet", "--"]);
        command
    }

    /// A Cargo command on this program.
    pub fn cargo(self, verb: &str) -> Command {
        let (package, program) = self.names();
        cargo(&[verb, "--package", package, "--bin", program])
    }
}

/// Where a program lies: the one that is named, or one that is built now.
pub fn built(program: Program, named: Option<&Path>) -> Result<String> {
    let (_, name) = program.names();
    if let Some(path) = named {
        ensure!(path.is_file(), "{} is no program: --{name} names a {name} that is built", path.display());
        return Ok(std::path::absolute(path)?.display().to_string());
    }
    run(&mut program.cargo("build"))?;
    Ok(target().join("debug").join(name).display().to_string())
}

/// Where Cargo builds.
fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// The program that writes the models of `cargo xtask engines`, up to its own arguments.
pub fn engine_cases() -> Command {
    cargo(&["run", "--quiet", "--package", "truing-export", "--example", "engine_cases", "--"])
}

/// The program that draws the round trips of `cargo xtask engines --back`, up to its own arguments.
pub fn engine_trips() -> Command {
    cargo(&["run", "--quiet", "--package", "trials", "--example", "engine_trips", "--"])
}

/// Builds the library that FMUs carry.
pub fn fmu_library() -> Command {
    cargo(&["rustc", "--package", "truing-fmu", "--lib", "--crate-type", "cdylib"])
}

/// Where it lies then, in a folder below that of Cargo.
pub fn fmu_library_in(folder: &str) -> PathBuf {
    use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
    target().join(folder).join(format!("{DLL_PREFIX}truing_fmu{DLL_SUFFIX}"))
}

/// The library that `truing export` puts into an FMU, small: it is loaded by programs that have a C library already.
pub fn stripped_fmu_library() -> Result<PathBuf> {
    let host = host()?;
    let mut build = fmu_library();
    run(build.env("RUSTFLAGS", "-C strip=symbols").args(["--release", "--locked", "--target", &host]))?;
    Ok(fmu_library_in(&format!("{host}/release")))
}

/// What this machine is to the compiler.
pub fn host() -> Result<String> {
    let told = Command::new("rustc").arg("-vV").output().context("rustc cannot be started")?;
    let told = String::from_utf8_lossy(&told.stdout);
    let host = told.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).context("rustc does not say for what it compiles")
}

/// A Cargo command on an example of the library.
pub fn example(verb: &str, name: &str) -> Command {
    cargo(&[verb, "--package", "servo", "--example", name])
}

/// The tests that mutants are tried with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Judge {
    /// Drivers, protection and image, without the workbench.
    Narrow,
    /// Simulated motors.
    ClosedLoops,
}

impl Judge {
    /// Package and name of the test.
    pub fn names(self) -> (&'static str, &'static str) {
        match self {
            Judge::Narrow => ("mutants", "narrow"),
            Judge::ClosedLoops => ("host-tests", "closed_loop"),
        }
    }

    /// `cargo test` with this profile of Cargo's.
    pub fn test(self, profile: &str) -> Command {
        let (package, test) = self.names();
        cargo(&["test", "--package", package, "--test", test, "--profile", profile])
    }
}

/// `cargo mutants` on the packages that it changes.
pub fn mutants() -> Command {
    cargo(&["mutants", "--package", "servo", "--package", Program::Firmware.package()])
}

/// Servo, engine and what reads and tells for it. The command line cannot be packed: it knows the boards, whose data lie with the image.
const PACKED: [&str; 6] =
    ["servo", "reference-plant", ENGINE, "truing-formats", "truing-files", "truing-report"];

/// They as a choice of packages.
pub fn packed() -> Vec<&'static str> {
    PACKED.iter().flat_map(|name| ["--package", name]).collect()
}

/// Packs them without building them anew.
pub fn packing() -> Command {
    let mut command = cargo(&["package", "--quiet", "--no-verify", "--allow-dirty"]);
    command.args(packed());
    command
}

/// Installs the command line from this checkout into a folder, as README says but without optimisation: it is built already.
pub fn install(folder: &Path) -> Command {
    let mut command =
        cargo(&["install", "--quiet", "--locked", "--debug", "--force", "--path", "workbench", "--root"]);
    command.arg(folder);
    command
}

/// The workbench's engine.
const ENGINE: &str = "truing-core";

/// Checks the engine for a target without a system and without threads.
pub fn engine_check(target: &str) -> Command {
    cargo(&["check", "--package", ENGINE, "--no-default-features", "--target", target])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::targets::Targets;

    #[test]
    fn every_program_that_is_started_exists() {
        let targets = Targets::read().unwrap();
        for program in Program::value_variants() {
            let (package, name) = program.names();
            targets.find(package, Some(("bin", name))).unwrap();
        }
        for judge in Judge::value_variants() {
            let (package, name) = judge.names();
            targets.find(package, Some(("test", name))).unwrap();
        }
    }

    #[test]
    fn the_engine_is_a_package() {
        Targets::read().unwrap().find(ENGINE, None).unwrap();
    }

    /// A name that stands elsewhere would not be compared.
    #[test]
    fn packages_are_named_here_alone() {
        let word = ["--pack", "age"].concat();
        for entry in std::fs::read_dir(crate::process::root().join("xtask/src")).unwrap() {
            let path = entry.unwrap().path();
            let text = std::fs::read_to_string(&path).unwrap();
            let here = path.ends_with("programs.rs") || path.ends_with("documents.rs");
            assert!(here || !text.contains(&word), "{}", path.display());
        }
    }
}
