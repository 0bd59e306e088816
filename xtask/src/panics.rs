//! What of the control interrupt can end in a panic.

use crate::image;
use crate::process::run;
use crate::programs::Program;
use anyhow::Result;
use std::process::Stdio;

/// The control interrupt's entry in the vector table.
const ROOT: &str = "ADC";
/// What is accepted, with reasons.
const ACCEPTED: &str = "host-tests/panic-paths/accepted.txt";

/// Builds the board's image and walks its calls; fails on a way to a panic that is not listed. `silent`: without the list.
pub fn check(silent: bool) -> Result<()> {
    let image = image::build("stm32f405")?;
    let mut walk = Program::PanicPaths.run();
    if silent {
        walk.stdout(Stdio::null());
    }
    run(walk.arg(image).args([ROOT, ACCEPTED]))
}
