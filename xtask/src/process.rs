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
    // A QEMU that could not be installed lies beside what is built.
    if let (None, None, Some(qemu)) = (find(QEMU), std::env::var_os("TRUING_QEMU"), unpacked_qemu()) {
        command.env("TRUING_QEMU", qemu);
    }
    command
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
