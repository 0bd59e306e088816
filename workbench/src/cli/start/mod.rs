//! `truing start`: from a log and what is printed on a motor to a commented model file.

mod questions;
mod sheet;
mod template;
mod units;
mod window;

use clap::Args;
use sheet::Sheet;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use template::Found;
use truing_core::gap::completed;
use truing_core::gap::start_values::line_of;
use truing_core::system::model;
use truing_core::text::input_error::InputError;
use truing_files::log::{self, Dynamic, Input, Log};
use truing_report::console::files::Files;
use truing_report::console::rows::Rows;
use truing_report::report::{figure, write_atomically};

/// For the help.
const EXAMPLES: &str = "\
Every number may carry its unit: --inertia 10.5gcm2, --kt \"23.5 mNm/A\", --stall-torque 1.2kgcm. What is not given is taken as unknown: it is \
fitted to the log with a wide prior. In a terminal, without any of the printed figures, `truing start` asks for them.

Examples:
  truing start --log run.csv
  truing start --log run.csv --columns \"t_ms=time_ms,omega_rpm=rpm,u_v=pwm*0.0470588\" --voltage 12 --no-load-rpm 3000 --stall-current 5
  truing start --voltage 24 --resistance 1.5 --kt 0.117 --inertia 10.4gcm2 --counts-per-rev 4096";

/// Arguments of `truing start`.
#[derive(Args, Debug, Clone, Default)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The log, CSV: a record over time, or a table of steady states.
    #[arg(long)]
    pub log: Option<PathBuf>,
    /// What is read of it.
    #[command(flatten)]
    pub rows: Rows,
    /// What is printed on the motor.
    #[command(flatten)]
    pub sheet: Sheet,
    /// The model file to write; `-`: standard output.
    #[arg(long, default_value = "model.toml")]
    pub out: PathBuf,
    /// Replace a file that exists.
    #[arg(long)]
    pub force: bool,
}

/// Asks, estimates, writes, and says what to run next.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let out = &arguments.out;
    Files::default().reads("--log", &arguments.log).writes("--out", [out]).check()?;
    let to_screen = out == Path::new("-");
    if out.exists() && !arguments.force && !to_screen {
        let what = "exists; name another file with --out, or replace it with --force";
        return Err(InputError::file(out.display(), what).into());
    }
    let columns = arguments.rows.read(None)?;
    let log = arguments.log.as_ref().map(|path| log::read(path, &columns)).transpose()?;
    let mut arguments = arguments.clone();
    let terminal = std::io::stdin().is_terminal() && std::io::stdout().is_terminal();
    let asks = terminal && arguments.sheet.is_empty();
    if asks {
        questions::ask(&mut arguments.sheet)?;
    }
    let complaints = arguments.sheet.complaints();
    if !asks {
        InputError::all(complaints.iter().cloned().map(InputError).collect())?;
    }
    let mut made = Made::from(&arguments, log.as_ref())?;
    // Answers that were typed are not lost over one that does not help.
    made.notes.extend(complaints);
    write_atomically(out, &made.text)?;
    if !to_screen {
        out!("{}", made.told(&arguments));
    }
    Ok(())
}

/// The file, and what a person must know of it.
pub struct Made {
    /// The file's text.
    pub text: String,
    /// What was found on the way, in sentences.
    pub notes: Vec<String>,
}

impl Made {
    /// Estimates and writes; without a log, what is printed alone.
    pub fn from(arguments: &Arguments, log: Option<&Log>) -> anyhow::Result<Self> {
        let sheet = &arguments.sheet;
        let name = arguments.out.display().to_string();
        let (window, line) = (window(sheet, log), log.and_then(line_of));
        let mut found = Found {
            model: None,
            shown: shown(log),
            settled: line.is_some_and(|line| line.time_constant_s.is_none()),
            window,
            log: arguments.log.as_ref().map(|path| path.display().to_string()),
            columns: arguments.rows.columns.clone(),
        };
        let draft = model::parse_draft(&name, &template::file(sheet, &found))?;
        let model = log.map(|log| completed(draft, log)).transpose()?;
        found.model = model.as_ref();
        let text = template::file(sheet, &found);
        let fitted = model.iter().flat_map(|model| model.notes.clone());
        let notes = fitted.chain(disagreement(sheet, log)).collect();
        // What is written must be what is read.
        model::parse_draft(&name, &text)?;
        Ok(Self { text, notes })
    }

    fn told(&self, arguments: &Arguments) -> String {
        let out = arguments.out.display().to_string();
        let mut told = format!("{out}\n\n{}\n", indented(&self.text));
        for note in &self.notes {
            told += &truing_report::report::terminal::beside("Note        ", note);
        }
        let log = arguments.log.as_ref().map_or("LOG.csv".into(), |path| path.display().to_string());
        let mut next = vec!["gap".to_owned(), "--model".into(), out, "--log".into(), log];
        let part = [("--from", arguments.rows.from), ("--to", arguments.rows.to)];
        for (option, seconds) in part.into_iter().filter_map(|(option, seconds)| Some((option, seconds?))) {
            next.extend([option.to_owned(), seconds.to_string()]);
        }
        next.extend(["--out".to_owned(), "result".into()]);
        told += &format!("\nNext:\n  {} {}\n", program(), shell_words::join(&next));
        told
    }
}

/// How many of a motor's numbers a log shows: a measured current tells friction and winding from the rest, a held one the friction.
fn shown(log: Option<&Log>) -> usize {
    match log {
        Some(Log::Dynamic(record)) if record.runs.iter().all(|run| run.current_a.is_some()) => 5,
        Some(Log::Dynamic(record)) if record.input != Input::Voltage => 4,
        _ => 3,
    }
}

/// How this program was called: `cargo run` tells its children where cargo is.
fn program() -> &'static str {
    if std::env::var_os("CARGO").is_some() { "cargo truing" } else { "truing" }
}

fn indented(text: &str) -> String {
    text.lines().map(|line| format!("  {line}").trim_end().to_owned() + "\n").collect()
}

/// The window of the logged speed: given, or found from its steps.
fn window(sheet: &Sheet, log: Option<&Log>) -> Option<(f64, &'static str)> {
    let found = || {
        let Some(Log::Dynamic(Dynamic { runs, .. })) = log else { return None };
        let seconds = window::of_speed(runs.first()?, sheet.counts_per_rev?)?;
        Some((seconds, "found: the logged speed rises in steps of one count over this time"))
    };
    sheet.speed_window_s.map(|seconds| (seconds, "given")).or_else(found)
}

/// The log turns faster or slower than this times what is printed: something is in another unit, or on the other side of a gear.
const DISAGREES: f64 = 1.6;

fn disagreement(sheet: &Sheet, log: Option<&Log>) -> Option<String> {
    let (seen, expected) = (line_of(log?)?.gain.abs(), sheet.expected_gain()?);
    let factor = seen / expected;
    (!(1.0 / DISAGREES..DISAGREES).contains(&factor)).then(|| {
        format!(
            "The log shows {} rad/s per volt, the printed no-load speed says {}: a factor of {}. Is the printed speed that of the other \
             side of the gear (--gear, --printed-at-output, --encoder-at-output), or is a column in another unit?",
            figure(seen),
            figure(expected),
            figure(factor)
        )
    })
}
