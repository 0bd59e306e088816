//! `truing export`: a model as a file of another program.

use crate::constants;
use crate::cost;
use crate::held::{self, Format};
use crate::{helper, mjcf, numbers, plan, ranges, urdf};
use anyhow::bail;
use clap::Args;
use std::path::{Path, PathBuf};
use truing_core::system::log::{Columns, Dynamic, Log};
use truing_core::system::model::Model;
use truing_files::{log, model};
use truing_fmu::{Version, package};
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
    let out = arguments.out.as_deref().unwrap_or(Path::new("-"));
    let head = head(&model);
    match arguments.to {
        Format::SysidConstants => write_atomically(out, &constants::written(&model, &head))?,
        Format::Mjcf => arguments.mjcf(&model, out, &head)?,
        Format::Urdf => write_atomically(out, &urdf::written(&model, &head))?,
        Format::Fmu3 => arguments.fmu(&model, Version::Three)?,
        Format::Fmu2 => arguments.fmu(&model, Version::Two)?,
    }
    if arguments.ranges {
        write_atomically(&arguments.beside("_ranges.py")?, &ranges::written(&model, &head))?;
    }
    let is_fmu = matches!(arguments.to, Format::Fmu2 | Format::Fmu3);
    let lost = held::lost(&model, arguments.to);
    for line in cost::told(&model, &lost, log.as_ref())? {
        errln!("{line}");
    }
    let unnamed = if is_fmu { &[] } else { model.unnamed.as_slice() };
    for term in unnamed {
        errln!("not held: {}, a table without a name", term.name);
    }
    Ok(())
}

impl Arguments {
    /// The file, and the helper beside it if it needs one.
    fn mjcf(&self, model: &Model, out: &Path, head: &[String]) -> anyhow::Result<()> {
        let plant = model.physics();
        if plant.source_ohm > 0.0 && !plant.supply_v.is_finite() {
            bail!("{}: a supply that sags needs its voltage; write nominal_v under [supply]", model.source);
        }
        if plan::Plan::of(&plant).helper() {
            write_atomically(&self.beside("_helper.py")?, &helper::written(&plant, head))?;
        }
        write_atomically(out, &mjcf::written(model, head))
    }

    /// The FMU, which is a file and never a text.
    fn fmu(&self, model: &Model, version: Version) -> anyhow::Result<()> {
        let Some(out) = self.out.as_ref().filter(|out| *out != Path::new("-")) else {
            bail!("an FMU is an archive: name it with --out motor.fmu");
        };
        let library = package::library(self.fmu_library.as_deref())?;
        write_bytes(out, &package::packed(model, version, &library)?)
    }

    /// A file beside the one that is written: `servo.xml` has `servo_helper.py`.
    fn beside(&self, ending: &str) -> anyhow::Result<PathBuf> {
        let out = self.out.as_ref().filter(|out| *out != Path::new("-"));
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

/// Origin, units, date, and every number with its deviation.
pub fn head(model: &Model) -> Vec<String> {
    let now = jiff::Timestamp::now().to_string();
    let source = Path::new(&model.source)
        .file_name()
        .map_or(model.source.clone(), |name| name.to_string_lossy().into_owned());
    let mut lines = vec![
        format!("Written by truing {} from {source}, {}.", env!("CARGO_PKG_VERSION"), &now[..10]),
        "SI units; ± is one standard deviation. The numbers of the model:".into(),
    ];
    lines.extend(numbers::stated(model).iter().map(numbers::Number::told));
    lines
}
