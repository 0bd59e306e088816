//! Instructions per control tick of the image as it is.

use crate::image;
use crate::process::{cargo, run};
use anyhow::Result;

/// Builds the image for QEMU and has `truing instructions` count.
pub fn print() -> Result<()> {
    let image = image::build("qemu")?;
    let mut truing = cargo(&[
        "run",
        "--quiet",
        "--package",
        "truing",
        "--",
        "instructions",
        "--image",
    ]);
    run(truing.arg(image))
}
