//! What of control, link and idle can end in a panic.

use crate::image::{Boards, Image};
use crate::process::run;
use crate::programs::Program;
use anyhow::Result;
use boards::Board;
use std::process::Stdio;

/// What is accepted, with reasons.
const ACCEPTED: &str = "tools/panic-paths/accepted.txt";

/// Builds the image of each board that is no program and walks its calls; fails on a way to a panic that is not listed. `silent`: without the list.
pub fn check(boards: Boards, silent: bool) -> Result<()> {
    boards.real().try_for_each(|board| check_board(board, silent))
}

fn check_board(board: &'static Board, silent: bool) -> Result<()> {
    let image = Image::of(board).build()?;
    let tasks = &board.chip.tasks;
    let mut walk = Program::PanicPaths.run();
    if silent {
        walk.stdout(Stdio::null());
    }
    run(walk.arg(image).arg(ACCEPTED).args([tasks.control, tasks.link, tasks.idle]))
}
