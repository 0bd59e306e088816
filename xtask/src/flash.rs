//! The image onto a board, or as if onto a board.

use crate::image::{Boards, Image};
use crate::process::{find, run};
use crate::programs::Program;
use anyhow::{Result, bail};
use boards::Board;
use std::path::Path;
use std::process::Command;

const PROBE: &str = "probe-rs";

/// A board of the table that can be flashed, by its name.
pub fn board(name: &str) -> Result<&'static Board, String> {
    let names = || boards::real().map(|board| board.name).collect::<Vec<_>>().join(", ");
    boards::real().find(|board| board.name == name).ok_or_else(|| format!("known boards: {}", names()))
}

/// Builds the image of a board, flashes and runs it, and shows its log until Ctrl-C. With `dry_run` it is checked against the
/// chip's memory map instead; that needs no probe, no board and no installed program.
pub fn flash(board: &'static Board, dry_run: bool) -> Result<()> {
    if !dry_run && find(PROBE).is_none() {
        bail!(
            "the program {PROBE} is missing: install it as https://probe.rs tells, or type `cargo xtask flash --board {} --dry-run`, which needs no probe",
            board.name
        );
    }
    let image = Image::of(board).build()?;
    match dry_run {
        true => check(&image, board),
        false => run(Command::new(PROBE).args(["run", "--chip", board.chip.probe]).arg(image)),
    }
}

/// The dry run of each board.
pub fn dry_runs(boards: Boards) -> Result<()> {
    boards.real().try_for_each(|board| flash(board, true))
}

fn check(image: &Path, board: &Board) -> Result<()> {
    println!("dry run: {} for {}, {}", image.display(), board.name, board.chip.probe);
    run(Program::FlashDryRun.run().arg(image).arg(board.name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_are_found_by_name_and_others_are_answered_with_the_list() {
        assert_eq!(board("odrive-v3").unwrap(), &boards::ODRIVE_V3);
        let error = board("odrive").unwrap_err();
        assert!(
            error.contains("odrive-v3, ") && error.contains("vesc-6") && !error.contains("qemu"),
            "{error}"
        );
    }
}
