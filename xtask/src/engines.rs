//! Exports in the engines that they are for: a virtual environment in `target/engines` with what can be had, and the scripts of
//! `tools/engines`.

use crate::process::{install_or_skip, python_in, root, run};
use crate::programs::{self, Program};
use anyhow::Result;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Versions that the figures of docs/export.md were made with. What cannot be installed is skipped by name.
const ENGINES: [&str; 5] = ["numpy", "mujoco==4.0.0", "pybullet==3.2.7", "drake==1.51.1", "fmpy==0.3.32"];

/// What to run.
#[derive(clap::Args, Debug)]
pub struct Choice {
    /// The round trip alone: logs of drawn motors with one effect each, made by the engine and searched for names. Takes half an hour.
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
    let (cases, trips) = (out.join("cases"), out.join("trips"));
    let script = |name: &str, folder: &Path| {
        let mut command = Command::new(&python);
        command
            .arg(root().join("tools/engines").join(name))
            .args(["--truing", &truing, "--folder"])
            .arg(folder);
        command
    };
    if choice.back {
        run(programs::engine_trips().arg(&trips))?;
        return run(&mut script("mujoco_back.py", &trips));
    }
    run(programs::engine_cases().arg(&cases))?;
    run(&mut script("mujoco_runs.py", &cases))?;
    run(&mut script("urdf_runs.py", &cases))?;
    // It lies where Cargo builds, whatever Truing was named.
    run(&mut programs::fmu_library())?;
    run(script("fmu_runs.py", &cases).arg("--library").arg(programs::fmu_library_in("debug")))
}
