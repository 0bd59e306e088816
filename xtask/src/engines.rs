//! Exports in the engines that they are for: a virtual environment in `target/engines` with what can be had, and the scripts of
//! `tools/engines`.

use crate::process::{install_or_skip, python_in, root, run};
use crate::programs::{self, Program};
use anyhow::Result;
use std::path::PathBuf;
use std::process::Command;

/// Versions that the figures of docs/export.md were made with. What cannot be installed is skipped by name.
const ENGINES: [&str; 5] = ["numpy", "mujoco==4.0.0", "pybullet==3.2.7", "drake==1.51.1", "fmpy==0.3.32"];

/// What to run.
#[derive(clap::Args, Debug)]
pub struct Choice {
    /// The round trip as well: a log of each effect made by the engine, searched for names. Takes minutes.
    #[arg(long)]
    back: bool,
    /// A Truing that is built already.
    #[arg(long)]
    truing: Option<PathBuf>,
}

/// Runs every export in its engine and prints the table.
pub fn compare(choice: &Choice) -> Result<()> {
    let out = root().join("target/engines");
    let python = python_in(&out)?;
    install_or_skip(&python, &ENGINES);
    let truing = programs::built(Program::Truing, choice.truing.as_deref())?;
    let folder = out.join("cases").display().to_string();
    run(programs::engine_cases().arg(&folder))?;
    let script = |name: &str| {
        let mut command = Command::new(&python);
        command.arg(root().join("tools/engines").join(name)).args(["--truing", &truing, "--folder", &folder]);
        command
    };
    let mut mujoco = script("mujoco_runs.py");
    if choice.back {
        mujoco.arg("--back");
    }
    run(&mut mujoco)?;
    run(&mut script("urdf_runs.py"))?;
    // It lies where Cargo builds, whatever Truing was named.
    run(&mut programs::fmu_library())?;
    run(script("fmu_runs.py").arg("--library").arg(programs::fmu_library_in("debug")))
}
