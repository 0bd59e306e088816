//! What of the control interrupt can end in a panic.

use crate::image;
use crate::process::{cargo, run};
use anyhow::Result;

/// The control interrupt's entry in the vector table.
const ROOT: &str = "ADC";
/// What is accepted, with reasons.
const ACCEPTED: &str = "host-tests/panic-paths/accepted.txt";

/// Builds the board's image and walks its calls; fails on a way to a panic that is not listed. In a package of its own,
/// because only this reads debug information.
pub fn check() -> Result<()> {
    let image = image::build("stm32f405")?;
    let arguments = ["run", "--quiet", "--package", "panic-paths", "--"];
    run(cargo(&arguments).arg(image).args([ROOT, ACCEPTED]))
}
