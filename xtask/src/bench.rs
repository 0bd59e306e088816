//! Our identifier, compensator and loop beside published crates, counted in one run of QEMU.

use crate::process::{cargo, run};
use anyhow::Result;

/// Prints the table of docs/cost.md.
pub fn print() -> Result<()> {
    run(&mut cargo(&[
        "run",
        "--quiet",
        "--package",
        "host-tests",
        "--bin",
        "bench_image",
    ]))
}
