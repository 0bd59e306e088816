//! The two firmware images.

use crate::process::{root, run};
use crate::programs::Program;
use crate::setup::TARGET;
use anyhow::{Context, Result};
use std::path::PathBuf;
use std::process::Command;

/// The board's image for as many axes as the chip can drive: built to see that it fits.
pub const FOUR_AXES: &str = "stm32f405-four-axes";

/// Builds the image of each board into `target/images/`.
pub fn build_all() -> Result<()> {
    for board in ["stm32f405", "qemu"] {
        build(board)?;
    }
    Ok(())
}

/// A Cargo command on the image for one board.
pub fn command(verb: &str, board: &str) -> Command {
    let mut command = Program::Firmware.cargo(verb);
    command.args(["--target", TARGET, "--profile", "firmware"]);
    match board {
        "qemu" => drop(command.args(["--features", "qemu"])),
        FOUR_AXES => drop(command.args(["--features", "four-axes"])),
        _ => {}
    }
    command
}

/// A Cargo command on an example of the library for the chip, with what the images have compiled already.
pub fn example(verb: &str, name: &str) -> Command {
    let mut command = Program::Firmware.example(verb, name);
    command.args(["--target", TARGET, "--profile", "firmware"]);
    command
}

/// Builds one image and returns where it lies. Both boards share Cargo's output name, so the file is copied.
pub fn build(board: &str) -> Result<PathBuf> {
    run(&mut command("build", board))?;
    let folder = root().join("target/images");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let image = folder.join(format!("{board}.elf"));
    let built = root().join("target").join(TARGET).join("firmware/firmware");
    std::fs::copy(&built, &image)
        .with_context(|| format!("cannot copy {} to {}", built.display(), image.display()))?;
    Ok(image)
}
