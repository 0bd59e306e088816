//! `truing export`: a model as a file of another program.

use crate::held::Format;
use crate::made::{Made, Request};
use anyhow::bail;
use clap::Args;
use std::path::{Path, PathBuf};
use truing_core::system::log::{Columns, Dynamic, Log};
use truing_core::system::model::Model;
use truing_files::{log, model};
use truing_report::console::files::Files;
use truing_report::report::{write_atomically, write_bytes};

/// For the help.
const EXAMPLES: &str = "\
Examples:
  truing export --to mjcf result/model.extended.toml --out servo.xml --log run.csv
  truing export --to sysid-constants model.toml";

/// Arguments of `truing export`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The model, TOML; its `[known.*]` effects go with it.
    pub model: PathBuf,
    /// The format.
    #[arg(long)]
    pub to: Format,
    /// Where the file goes; without it: standard output.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Write ranges for domain randomisation beside it, as Python: ± two standard deviations, for mjlab and IsaacLab.
    #[arg(long)]
    pub ranges: bool,
    /// A log, on whose input it is told what the loss of an effect costs.
    #[arg(long)]
    pub log: Option<PathBuf>,
    /// Foreign column names of the log, as in `truing gap`.
    #[arg(long, default_value = "", hide_default_value = true)]
    pub columns: String,
    /// The library that an FMU carries; without it: the one beside this program, or that of TRUING_FMU_LIBRARY.
    #[arg(long)]
    pub fmu_library: Option<PathBuf>,
}

/// Reads, writes, tells what is lost.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    Files::default()
        .reads("MODEL", [&arguments.model])
        .reads("--log", &arguments.log)
        .writes("--out", &arguments.out)
        .check()?;
    let model = model::read(&arguments.model)?;
    let log = arguments.input(&model)?;
    if arguments.to.is_fmu() && arguments.file().is_none() {
        bail!("an FMU is an archive: name it with --out motor.fmu");
    }
    let made = Made::of(&model, &arguments.request(log.as_ref()))?;
    for (ending, text) in &made.beside {
        write_atomically(&arguments.beside(ending)?, text)?;
    }
    match arguments.file() {
        Some(out) => write_bytes(out, &made.file)?,
        None => write_atomically(Path::new("-"), made.text()?)?,
    }
    for line in &made.lost {
        errln!("{line}");
    }
    Ok(())
}

impl Arguments {
    /// What is asked for, with the log that was read.
    pub fn request<'a>(&'a self, log: Option<&'a Dynamic>) -> Request<'a> {
        Request { to: self.to, ranges: self.ranges, log, fmu_library: self.fmu_library.as_deref() }
    }

    /// Where the file goes, if not to standard output.
    fn file(&self) -> Option<&Path> {
        self.out.as_deref().filter(|out| *out != Path::new("-"))
    }

    /// A file beside the one that is written: `servo.xml` has `servo_helper.py`.
    fn beside(&self, ending: &str) -> anyhow::Result<PathBuf> {
        let out = self.file();
        let Some(stem) = out.and_then(|out| out.file_stem()) else {
            bail!("a second file belongs to this model, {ending}: name the first one with --out FILE");
        };
        let name = format!("{}{ending}", stem.to_string_lossy());
        Ok(out.map_or_else(PathBuf::new, |out| out.with_file_name(name)))
    }

    fn input(&self, model: &Model) -> anyhow::Result<Option<Dynamic>> {
        let Some(path) = &self.log else { return Ok(None) };
        match log::read_input(path, &Columns::of(&self.columns, model)?)? {
            Log::Dynamic(log) => Ok(Some(log)),
            Log::Table(_) => bail!("{}: has no time column; a cost needs t_s", path.display()),
        }
    }
}
