//! `truing import`: a nominal model out of a file of another program.

use crate::import;
use anyhow::Context;
use clap::Args;
use std::path::{Path, PathBuf};
use truing_report::console::files::Files;
use truing_report::report::write_atomically;

/// Arguments of `truing import`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// An MJCF or a URDF file; of several joints, the first that an actuator drives.
    pub file: PathBuf,
    /// Where the model goes; without it: standard output.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Reads and writes.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    Files::default().reads("FILE", [&arguments.file]).writes("--out", &arguments.out).check()?;
    let path = &arguments.file;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("{}: cannot be read; check the path", path.display()))?;
    let model = import::model(&name, &text)?;
    write_atomically(arguments.out.as_deref().unwrap_or(Path::new("-")), &model)
}
