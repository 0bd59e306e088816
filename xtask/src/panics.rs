//! What of the control interrupt can end in a panic.

use crate::image;
use crate::process::{cargo, run};
use anyhow::Result;
use std::process::Stdio;

/// The control interrupt's entry in the vector table.
const ROOT: &str = "ADC";
/// What is accepted, with reasons.
const ACCEPTED: &str = "host-tests/panic-paths/accepted.txt";

/// Builds the board's image and walks its calls; fails on a way to a panic that is not listed. In a package of its own,
/// because only this reads debug information. `silent`: without the list.
pub fn check(silent: bool) -> Result<()> {
    let image = image::build("stm32f405")?;
    let arguments = [
        "run",
        "--quiet",
        "--package",
        "panic-paths",
        "--bin",
        "panic-paths",
        "--",
    ];
    let mut walk = cargo(&arguments);
    if silent {
        walk.stdout(Stdio::null());
    }
    run(walk.arg(image).args([ROOT, ACCEPTED]))
}
