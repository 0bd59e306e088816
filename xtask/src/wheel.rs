//! The Python package: built by maturin, tested in an environment of its own.

use crate::process::{self, find, root, run};
use crate::programs::{self, Program};
use anyhow::{Context, Result, bail};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Builds the wheel.
const MATURIN: &str = "maturin==1.16.0";
/// What the tests and the notebooks need beside the wheel.
const FOR_TESTS: [&str; 9] =
    ["pytest", "mypy", "pandas", "pandas-stubs", "polars", "pyarrow", "matplotlib", "nbclient", "ipykernel"];

/// Runs fleets, and is large: its test is left out where it cannot be had.
const RAY: &str = "ray>=2.40";

/// Where the project of the package lies.
fn source() -> PathBuf {
    root().join("workbench").join("python")
}

/// Where everything is built.
fn folder() -> PathBuf {
    root().join("target").join("wheel")
}

/// Builds the wheel, and tests it if that is asked for.
pub fn wheel(check: bool) -> Result<()> {
    let wheel = build()?;
    let size = std::fs::metadata(&wheel).with_context(|| format!("{}", wheel.display()))?.len();
    println!(
        "{}: {:.2} MiB",
        wheel.strip_prefix(root()).unwrap_or(&wheel).display(),
        size as f64 / 1_048_576.0
    );
    if check { test(&wheel) } else { Ok(()) }
}

/// Builds it; there is one file afterwards.
pub fn build() -> Result<PathBuf> {
    let python = environment("build", &[MATURIN.as_ref()])?;
    let library = programs::stripped_fmu_library()?;
    let carried = source().join("truing").join(library.file_name().context("a library has a name")?);
    std::fs::copy(&library, &carried).with_context(|| format!("cannot write {}", carried.display()))?;
    let out = folder().join("out");
    let _ = std::fs::remove_dir_all(&out);
    let mut maturin = Command::new(python);
    maturin.args(["-m", "maturin", "build", "--release", "--locked", "--out"]).arg(&out);
    run(maturin.current_dir(source()).env("CARGO_TARGET_DIR", folder().join("cargo")))?;
    let built = std::fs::read_dir(&out).context("maturin wrote nothing")?.next();
    Ok(built.context("maturin wrote no wheel")??.path())
}

/// Tests in a fresh environment: nothing is there but what the wheel asks for, and the tests' own tools.
fn test(wheel: &Path) -> Result<()> {
    let _ = std::fs::remove_dir_all(folder().join("check"));
    let python = environment("check", &[wheel.as_os_str()])?;
    run(Command::new(&python).args(["-c", "import truing; truing.effects()"]).current_dir(folder()))
        .context("the wheel does not stand alone")?;
    install(&python, &FOR_TESTS.map(OsStr::new))?;
    if install(&python, &[RAY.as_ref()]).is_err() {
        println!("skipped: the fleet on {RAY}, which cannot be installed");
    }
    let mut typed = Command::new(&python);
    typed.args(["-m", "mypy", "--strict", "examples", "tests/test_gap.py"]);
    run(typed.current_dir(source()).env("MYPY_CACHE_DIR", folder().join("mypy")))?;
    run(&mut Program::Truing.cargo("build"))?;
    let mut tests = Command::new(&python);
    tests.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"]).current_dir(source());
    // Of the sources beside the tests nothing may be imported: the wheel is tested.
    tests.args(["--import-mode", "importlib"]).env("PYTHONSAFEPATH", "1").env("PYTHONDONTWRITEBYTECODE", "1");
    run(tests.env("TRUING_PROGRAM", root().join("target").join("debug").join("truing")))
}

/// The Python of an environment in which these packages are.
fn environment(name: &str, packages: &[&OsStr]) -> Result<PathBuf> {
    let Some(system) = find("python3") else {
        bail!("python3 is not there; install Python 3.10 or later, with its module venv");
    };
    let folder = folder().join(name);
    let python = folder.join("bin").join("python");
    if !python.is_file() {
        run(Command::new(system).args(["-m", "venv"]).arg(&folder))
            .context("Python has no module venv; on Debian: apt install python3-venv")?;
    }
    install(&python, packages).map(|()| python)
}

fn install(python: &Path, packages: &[&OsStr]) -> Result<()> {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(packages);
    process::run(&mut pip)
}
