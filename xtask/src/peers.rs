//! Other programs on the same data: a virtual environment in `target/peers` with what can be had, the scripts of
//! `evaluation/peers`, and the table of `docs/results/peers.md`.

use crate::process::{python_in, root, run};
use crate::programs::{self, Program};
use anyhow::Result;
use std::path::PathBuf;
use std::process::Command;

/// Versions that the table was made with. All of them or none: the scripts share the first line.
const SHARED: [&str; 3] = ["numpy==2.4.6", "scipy==1.17.1", "numba==0.68.1"];

/// A script of `evaluation/peers`, and what it needs beyond the shared packages.
const PEERS: [(&str, Option<&str>); 5] = [
    ("truing_gap", None),
    ("structured", None),
    ("mujoco_sysid", Some("mujoco[sysid]==4.0.0")),
    ("sparse", Some("pysindy==2.1.0")),
    ("stepwise", None),
];

/// What to compare.
#[derive(clap::Args, Debug)]
pub struct Choice {
    /// Three rigs alone, in a minute; the page stays as it is.
    #[arg(long)]
    quick: bool,
    /// Folder of the data that are published elsewhere.
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// A Truing that is built already.
    #[arg(long)]
    truing: Option<PathBuf>,
}

/// Runs every peer that can be installed, and writes the table.
pub fn compare(choice: &Choice) -> Result<()> {
    let bench = Bench::new(choice)?;
    bench.python(&["-m", "pip", "install", "--quiet"], &SHARED)?;
    let mut cases = vec!["--truing", &bench.truing, "--data", &bench.data, "--out", &bench.out];
    cases.extend(choice.quick.then_some("--quick"));
    bench.script("cases", &cases)?;
    for (peer, package) in PEERS {
        bench.peer(peer, package)?;
    }
    let page = root().join("docs/results/peers.md").display().to_string();
    let mut table = vec!["--results", bench.out.as_str()];
    if !choice.quick {
        table.extend(["--page", &page]);
    }
    bench.script("table", &table)
}

/// The environment: everything lies in `target/peers`.
struct Bench {
    python: PathBuf,
    out: String,
    data: String,
    truing: String,
}

impl Bench {
    fn new(choice: &Choice) -> Result<Self> {
        let out = root().join("target/peers");
        let python = python_in(&out)?;
        let data = root().join(&choice.data).display().to_string();
        Ok(Self {
            python,
            out: out.display().to_string(),
            data,
            truing: programs::built(Program::Truing, choice.truing.as_deref())?,
        })
    }

    /// One thread for each, so that CPU seconds compare.
    fn python(&self, arguments: &[&str], more: &[&str]) -> Result<()> {
        let mut command = Command::new(&self.python);
        for threads in ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS"] {
            command.env(threads, "1");
        }
        command.env("NUMBA_CACHE_DIR", format!("{}/compiled", self.out)).env("TRUING", &self.truing);
        run(command.args(arguments).args(more).current_dir(root().join("evaluation/peers")))
    }

    fn script(&self, name: &str, arguments: &[&str]) -> Result<()> {
        self.python(&[&format!("{name}.py")], arguments)
    }

    /// One peer; what cannot be installed is skipped by name, and an old result of it goes.
    fn peer(&self, name: &str, package: Option<&str>) -> Result<()> {
        let result = format!("{}/{name}.json", self.out);
        let _ = std::fs::remove_file(&result);
        if let Some(package) = package
            && self.python(&["-m", "pip", "install", "--quiet"], &[package]).is_err()
        {
            println!("skipped: {name}, because {package} cannot be installed");
            return Ok(());
        }
        self.script(name, &["--cases", &format!("{}/cases.json", self.out), "--out", &result])
    }
}
