//! Our identifier, compensator and loop beside published crates, counted in one run of QEMU.

use crate::process::run;
use crate::programs::Program;
use anyhow::Result;

/// Prints the table of docs/results/cost.md.
pub fn print() -> Result<()> {
    run(Program::Evaluation.run().arg("bench-image"))
}
