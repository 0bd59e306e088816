//! `truing gap`: where do model and log disagree, and what is missing?

use anyhow::anyhow;
use clap::Args;
use std::path::{Path, PathBuf};
use truing_core::gap::{self, Options, examine, time_base};
use truing_core::outcome::{DataFault, Outcome, Verdict};
use truing_core::system::effects;
use truing_core::text::input_error::{InputError, NotDone};
use truing_files::log::{self, Columns, Log};
use truing_files::model::{self, Draft, Model};
use truing_report::console::files::Files;
use truing_report::console::rows::Rows;
use truing_report::console::watched::watched;
use truing_report::report::{
    Exporter, grade, html::Html, json::Json, model_file::ModelFile, pictures, terminal::Terminal,
};

/// Below `--help`, not below `-h`.
const EXAMPLES: &str = "\
Examples:
  A model from a data sheet, one log; a quarter of the log is held out:
      truing gap --model motor.toml --log run.csv --out result
  A second record of the same motor, which is never fitted:
      truing gap --model motor.toml --log run.csv --holdout other.csv
  Other column names and units:
      truing gap --model motor.toml --log run.csv --columns \"t_ms=time_ms,u_v=pwm/255*12,omega_rpm=rpm\"
  In a script: the result on standard output, exit status 1 unless nothing is missing:
      truing gap --model motor.toml --log run.csv --json - --check

Columns that need no mapping, with their units in the name:
  time      t_s t_ms t_us                 current   i_a i_ma (measured); current_a (drives the axis)
  voltage   u_v u_mv; duty with vbus_v    torque    torque_nm; force_n on a linear axis
  speed     omega_rad_s omega_rpm v_m_s   position  theta_rad theta_deg theta_rev q_m q_mm
  others    vbus_v; bridge (0 open, 1 driven, 2 shorted); run (separate records)

`truing look run.csv` proposes --columns for a log with other names.
Pages: docs/log.md, docs/reading-a-verdict.md, docs/exit-codes.md";

/// Arguments of `truing gap`.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// The model, TOML.
    #[arg(long)]
    pub model: PathBuf,
    /// The log, CSV: a record over time, or a table of steady states; `-`: standard input.
    #[arg(long)]
    pub log: PathBuf,
    /// Further logs that are not fitted, only predicted.
    #[arg(long, num_args = 1..)]
    pub holdout: Vec<PathBuf>,
    /// Logs that are predicted at the very end and choose nothing: the figure that nobody chose by.
    #[arg(long = "final", num_args = 1.., hide_short_help = true)]
    pub finals: Vec<PathBuf>,
    /// What is read of them.
    #[command(flatten)]
    pub rows: Rows,
    /// Effects that are not offered (repeatable): how would the log be explained without them?
    #[arg(long, num_args = 1.., hide_short_help = true)]
    pub without: Vec<String>,
    /// Folder for report.html, outcome.json and the extended model, model.extended.toml.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Write the result as JSON; `-` is standard output, where nothing else is then printed.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Folder for the report's plots as SVG files.
    #[arg(long, hide_short_help = true)]
    pub pictures: Option<PathBuf>,
    /// Write the report as one HTML file; `-` as for --json.
    #[arg(long)]
    pub report: Option<PathBuf>,
    /// Go on although the files look wrong: a unit, a sign, a record of another motor.
    #[arg(long)]
    pub accept_data: bool,
    /// Exit status 1 unless nothing is missing: for scripts and builds.
    #[arg(long)]
    pub check: bool,
}

/// What `--out` writes into its folder.
const JSON: &str = "outcome.json";
const REPORT: &str = "report.html";
/// Not the usual name of a model: what the user wrote stays beside it.
const EXTENDED: &str = "model.extended.toml";

impl Arguments {
    fn files(&self) -> Files {
        let folder = |name: &str| self.out.as_ref().map(|folder| folder.join(name));
        Files::default()
            .reads("--model", [&self.model])
            .reads("--log", [&self.log])
            .reads("--holdout", &self.holdout)
            .writes("--json or --out", self.json.clone().into_iter().chain(folder(JSON)))
            .writes("--report or --out", self.report.clone().into_iter().chain(folder(REPORT)))
            .writes("--out", folder(EXTENDED))
    }
}

/// Reads, analyses, reports.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.files().check()?;
    let draft = model::read_draft(&arguments.model)?;
    let (model, outcome) = arguments.analysed(draft, &|path, columns| log::open(path, columns), &watched)?;
    if ![&arguments.json, &arguments.report].into_iter().flatten().any(|path| path == Path::new("-")) {
        out!("{}", Terminal.export(&outcome)?);
    }
    write(arguments, &model, &outcome)?;
    concluded(arguments, &outcome)
}

/// How a log is opened: what is called a path may be a table in memory.
pub type Open<'a> = &'a dyn Fn(&Path, &Columns) -> Result<log::Reading, InputError>;
/// How a search is watched.
pub type Watched<'a> = &'a dyn Fn(&Model, &Log, &[Log], &Options) -> Result<Outcome, InputError>;

impl Arguments {
    /// The completed model, and what is found.
    pub fn analysed(&self, draft: Draft, open: Open, watched: Watched) -> anyhow::Result<(Model, Outcome)> {
        let columns = self.rows.read(Some(draft.stated()))?;
        let log::Reading { log, mut notes } = open(&self.log, &columns)?;
        let model = gap::completed(draft, &log)?;
        // The crop is that of the log that is fitted.
        let whole = columns.clone().cropped(None, None);
        let mut read = |path: &PathBuf| -> Result<Log, InputError> {
            let reading = open(path, &whole)?;
            let source = path.display().to_string();
            notes.extend(reading.notes.into_iter().filter(|note| note.starts_with(&source)));
            Ok(reading.log)
        };
        let holdouts: Vec<Log> = self.holdout.iter().map(&mut read).collect::<Result<_, _>>()?;
        let known = |name: &String| effects::known(name).map(|effect| effect.name.to_owned());
        let without: Result<Vec<String>, String> = self.without.iter().map(known).collect();
        let finals = self.finals.iter().map(read).map(|log| gap::as_record(log?));
        let options = Options {
            finals: finals.collect::<Result<_, InputError>>()?,
            without: without.map_err(|text| anyhow!("--without: {text}"))?,
            accept_data: self.accept_data,
            ..Options::default()
        };
        // A time constant that is a millionth of itself makes any time look wrong: a key that is at fault goes first.
        let elsewhere = |fault: &DataFault| fault.place != "t_s";
        if let Log::Dynamic(record) = &log
            && !examine::faults(&model, &log, &[]).iter().any(elsewhere)
        {
            time_base::check(&model, record, &columns)?;
        }
        let mut outcome = watched(&model, &log, &holdouts, &options)?;
        outcome.notes.splice(0..0, notes);
        Ok((model, outcome))
    }
}

/// The exit status: an error if nothing was simulated, or if something is missing and `--check` asks.
fn concluded(arguments: &Arguments, outcome: &Outcome) -> anyhow::Result<()> {
    if outcome.verdict == Verdict::Data {
        let each: Vec<String> =
            outcome.data.iter().map(|fault| format!("{}: {}", fault.what, fault.remedy)).collect();
        let each = each.join("; ");
        let what = format!("nothing was simulated, because it looks as if {each}; or --accept-data");
        return Err(NotDone(what).into());
    }
    if arguments.check && outcome.verdict != Verdict::NothingMissing {
        return Err(NotDone(format!("--check: the verdict is `{}`", grade(outcome))).into());
    }
    Ok(())
}

fn write(arguments: &Arguments, model: &Model, outcome: &Outcome) -> anyhow::Result<()> {
    let folder = |name: &str| arguments.out.as_ref().map(|folder| folder.join(name));
    let subtitle = format!("{} against {}", told(&arguments.model), told(&arguments.log));
    let html = Html { subtitle: &subtitle, command: &command_line(std::env::args()) };
    let origin = arguments.log.display().to_string();
    let extended = ModelFile { original: &model.source_text, origin: &origin };
    for path in [arguments.json.clone(), folder(JSON)].into_iter().flatten() {
        Json.write(outcome, &path)?;
    }
    for path in [arguments.report.clone(), folder(REPORT)].into_iter().flatten() {
        html.write(outcome, &path)?;
    }
    if let Some(folder) = &arguments.pictures {
        pictures::write(outcome, folder)?;
    }
    folder(EXTENDED).map_or(Ok(()), |path: PathBuf| extended.write(outcome, Path::new(&path)))
}

/// A path as a page tells it: as it was typed, but nobody's folders.
fn told(path: &Path) -> String {
    let name = path.file_name().filter(|_| path.is_absolute());
    name.map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// A command line to be told and typed again.
fn command_line(arguments: impl Iterator<Item = String>) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=./,:+%@".contains(c);
    let quoted = |word: String| {
        let word = told(Path::new(&word));
        match !word.is_empty() && word.chars().all(plain) {
            true => word,
            false => format!("'{}'", word.replace('\'', "'\\''")),
        }
    };
    let words: Vec<String> =
        std::iter::once("truing".to_owned()).chain(arguments.skip(1).map(quoted)).collect();
    words.join(" ")
}
