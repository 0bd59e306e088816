//! What of control, link and idle can end in a panic.

use crate::image;
use crate::process::run;
use crate::programs::Program;
use anyhow::Result;
use std::process::Stdio;

/// Control and link by their entries in the vector table, and idle.
const ROOTS: [&str; 3] = ["ADC", "USART2", "firmware::app::idle"];
/// What is accepted, with reasons.
const ACCEPTED: &str = "tools/panic-paths/accepted.txt";

/// Builds the board's image and walks its calls; fails on a way to a panic that is not listed. `silent`: without the list.
pub fn check(silent: bool) -> Result<()> {
    let image = image::build("stm32f405")?;
    let mut walk = Program::PanicPaths.run();
    if silent {
        walk.stdout(Stdio::null());
    }
    run(walk.arg(image).arg(ACCEPTED).args(ROOTS))
}
