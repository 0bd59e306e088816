//! `truing improve` on motors with other people's physics: a virtual environment in `target/motors` with what can be had, and the
//! programs of `tools/motors` behind the image in QEMU.

use crate::image::Image;
use crate::process::{install_or_skip, python_in, root, run, with_qemu};
use crate::programs::{self, Program};
use crate::setup;
use anyhow::Result;
use std::path::PathBuf;
use std::process::Command;

/// Versions that the figures of docs/results were made with. A motor whose package cannot be installed is skipped by name.
const PACKAGES: [&str; 3] = ["mujoco==4.0.0", "scipy==1.17.1", "gym-electric-motor==3.0.3"];

/// What to run.
#[derive(clap::Args, Debug)]
pub struct Choice {
    /// Motor time of each, s.
    #[arg(long, default_value = "60")]
    budget_s: String,
    /// Runs of each motor, every one with another seed.
    #[arg(long, default_value = "1")]
    runs: String,
    /// A Truing that is built already.
    #[arg(long)]
    truing: Option<PathBuf>,
}

/// Improves each motor, and prints what was named and how it follows before and after.
pub fn improve(choice: &Choice) -> Result<()> {
    setup::everything()?;
    let out = root().join("target/motors");
    let python = python_in(&out)?;
    install_or_skip(&python, &PACKAGES);
    let truing = programs::built(Program::Truing, choice.truing.as_deref())?;
    let image = Image::of(&boards::QEMU).build()?;
    let mut runs = with_qemu(Command::new(&python));
    runs.arg(root().join("tools/motors/improve_runs.py")).args(["--truing", &truing]);
    runs.arg("--image").arg(image).arg("--folder").arg(&out);
    run(runs.args(["--budget-s", &choice.budget_s, "--runs", &choice.runs]))
}
