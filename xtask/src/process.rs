//! Child processes: start, wait, and one sentence when one fails.

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The emulator of the chip.
pub const QEMU: &str = "qemu-system-arm";

/// The project's folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask lies in the project").to_path_buf()
}

/// The Cargo that runs this program, in the project's folder.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments).current_dir(root());
    with_qemu(command)
}

/// A command whose programs find QEMU: one that could not be installed lies beside what is built.
pub fn with_qemu(mut command: Command) -> Command {
    if let (None, None, Some(qemu)) = (find(QEMU), std::env::var_os("TRUING_QEMU"), unpacked_qemu()) {
        command.env("TRUING_QEMU", qemu);
    }
    command
}

/// The Python of a virtual environment in this folder; both are made if they are missing.
pub fn python_in(folder: &Path) -> Result<PathBuf> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let python = folder.join("venv/bin/python");
    if !python.is_file() {
        run(Command::new("python3").args(["-m", "venv"]).arg(folder.join("venv")))
            .context("this needs Python 3.11 or later with its module venv")?;
    }
    Ok(python)
}

/// Installs these packages where they can be had; the others are skipped by name.
pub fn install_or_skip(python: &Path, packages: &[&str]) {
    for package in packages {
        if run(Command::new(python).args(["-m", "pip", "install", "--quiet", package])).is_err() {
            println!("skipped: {package} cannot be installed");
        }
    }
}

/// Runs to the end; a failure names the command.
pub fn run(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("cannot start `{}`", text(command)))?;
    if !status.success() {
        bail!("`{}` failed ({status})", text(command));
    }
    Ok(())
}

/// The command as a person would type it.
pub fn text(command: &Command) -> String {
    let program = Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    std::iter::once(program)
        .chain(command.get_args())
        .map(|word| word.to_string_lossy())
        .collect::<Vec<_>>()
        .join(" ")
}

/// Where `program` lies on the search path.
pub fn find(program: &str) -> Option<PathBuf> {
    std::env::split_paths(&std::env::var_os("PATH")?)
        .map(|folder| folder.join(program))
        .find(|path| path.is_file())
}

/// Where QEMU is unpacked when it cannot be installed.
pub fn qemu_folder() -> PathBuf {
    root().join("target").join("qemu")
}

/// QEMU as it was unpacked, if it was.
pub fn unpacked_qemu() -> Option<PathBuf> {
    Some(qemu_folder().join(QEMU)).filter(|program| program.is_file())
}
