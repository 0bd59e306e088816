//! `truing look`: what is in a log, before any model is asked.

use clap::Args;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use textplots::{Chart, LabelBuilder, LabelFormat, Plot, Shape};
use truing_core::system::log::answer::{Answer, Time, speed};
use truing_core::text::input_error::InputError;
use truing_files::log::look::{Column, Look, State};
use truing_files::log::{self, Log, in_digits, in_shell, short};
use truing_files::model;
use truing_report::console::files::Files;
use truing_report::console::rows::Rows;
use truing_report::report::format::shortened;
use truing_report::report::terminal::{INDENT, WIDTH, block, blocks, width};
use truing_report::report::write_atomically;

/// Characters of the name of a column, and of a whole row of the table.
const NAME: usize = 21;
const TABLE: usize = NAME + 45;
/// Dots of a plot at full width: two columns and four lines a character.
const PLOT: (u32, u32) = (112, 24);

/// For the help.
const EXAMPLE: &str = "\
Example:
  truing look log.csv
  truing look messung.csv --columns \"duty=pwm/255,vbus_v=12\" --model motor.toml
  truing look log.csv --json - | jq .columns_argument";

/// Arguments of `truing look`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLE)]
pub struct Arguments {
    /// The log, a table as text: CSV, or parted by semicolons, tabs or blanks.
    pub file: PathBuf,
    /// What is read of it.
    #[command(flatten)]
    pub rows: Rows,
    /// The model, TOML: its supply and its encoder make proposals better.
    #[arg(long)]
    pub model: Option<PathBuf>,
    /// Write the same as JSON; `-`: to standard output, and nothing else.
    #[arg(long)]
    pub json: Option<PathBuf>,
}

/// Reads and tells.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    Files::default()
        .reads("FILE", [&arguments.file])
        .reads("--model", &arguments.model)
        .writes("--json", &arguments.json)
        .check()?;
    let draft = arguments.model.as_deref().map(model::read_draft).transpose()?;
    let columns = arguments.rows.read(draft.as_ref().map(model::Draft::stated))?;
    let look = log::look(&arguments.file, &columns)?;
    let json = serde_json::to_string_pretty(&look)? + "\n";
    if arguments.json.as_deref() != Some(Path::new("-")) {
        out!("{}", told(&look)?);
    }
    arguments.json.as_ref().map_or(Ok(()), |path| write_atomically(path, &json))?;
    match look.refused {
        // The sentence is on the screen.
        Some(_) => Err(InputError::file(look.file, "cannot be read as it is; see above").into()),
        None => Ok(()),
    }
}

/// Everything in at most 80 columns.
fn told(look: &Look) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    block(&mut text, "File", &format!("{}: {} rows, {}", look.file, look.rows, look.written));
    text.push('\n');
    columns(&mut text, &look.columns)?;
    if let Some(time) = &look.time {
        block(&mut text, "\nTime", &of_time(time));
    }
    if let Some(answer) = &look.answer {
        block(&mut text, "Answer", &of_answer(answer));
    }
    if let Some(log) = &look.log {
        plots(&mut text, log)?;
    }
    if let Some(refused) = &look.refused {
        block(&mut text, "\nRefused", refused);
    }
    blocks(&mut text, "\nGuessed", &look.guessed);
    if !look.columns_argument.is_empty() {
        // One line, to be copied, however long.
        writeln!(text, "\n{:INDENT$}--columns {}", "Add", in_shell(&look.columns_argument))?;
    }
    blocks(&mut text, "\nNotes", &look.notes);
    blocks(&mut text, "\nNext time", &look.ask);
    Ok(text)
}

fn columns(text: &mut String, columns: &[Column]) -> std::fmt::Result {
    // A narrow terminal has no room for a margin.
    let (head, indent) = if width() < INDENT + TABLE { ("Columns\n", 0) } else { ("Columns", INDENT) };
    let wide = NAME.saturating_sub((indent + TABLE).saturating_sub(width())).max(6);
    writeln!(
        text,
        "{head:indent$}{:wide$} {:14} {:>9} {:>9} {:>9}",
        "name", "read as", "from", "to", "step"
    )?;
    for column in columns {
        let number = |value: Option<f64>| value.map_or("–".into(), short);
        let seems = match (&column.seems, column.state) {
            (None, _) => "– (not used)".into(),
            (Some(seems), State::Read) => seems.clone(),
            (Some(seems), State::Proposed) => format!("{seems} ?"),
            (Some(seems), State::Unused) => format!("({seems})"),
        };
        let [min, max, step] = [column.min, column.max, column.step].map(number);
        let name = shortened(&column.name, wide);
        let empty = if column.empty > 0 {
            format!("\n{:indent$}  {} cells are empty", "", column.empty)
        } else {
            String::new()
        };
        writeln!(text, "{:indent$}{name:wide$} {seems:14} {min:>9} {max:>9} {step:>9}{empty}", "")?;
    }
    Ok(())
}

fn of_time(time: &Time) -> String {
    let records = if time.records == 1 { "one record".into() } else { format!("{} records", time.records) };
    let gaps = match time.gaps {
        0 => "no gaps".into(),
        1 => format!("one gap of {} s", short(time.longest_s)),
        gaps => format!("{gaps} gaps, the longest of {} s", short(time.longest_s)),
    };
    let jitter = significant((1e4 * time.jitter).round() / 100.0);
    let (seconds, rate) = (short(time.seconds), significant(time.rate_hz));
    format!(
        "{records}, {seconds} s together, {rate} rows a second, steps even within ±{jitter}\u{a0}%, {gaps}"
    )
}

fn significant(value: f64) -> String {
    in_digits(value, 3)
}

fn of_answer(answer: &Answer) -> String {
    let sign = if answer.correlation < 0.0 { " against" } else { "" };
    let when = match answer.rows {
        ..1 => "before the input does".into(),
        1 => "at once, in the next row".into(),
        rows if answer.smooth => format!("{rows} rows later: delay and lag of the motor together"),
        rows => format!(
            "{rows} rows later: a delay of about {} ms, or a smoothed speed",
            significant(1e3 * answer.delay_s)
        ),
    };
    format!("the speed changes{sign} {when} (correlation of the changes {:.2})", answer.correlation)
}

fn plots(text: &mut String, log: &Log) -> std::fmt::Result {
    match log {
        Log::Table(table) => plot(text, "omega_rad_s over u_v", &table.u_v, &table.omega_rad_s, false),
        Log::Dynamic(record) => {
            let Some(run) = record.runs.iter().max_by_key(|run| run.rows()) else { return Ok(()) };
            let which = if record.runs.len() > 1 { format!(", run {}", run.id) } else { String::new() };
            let input = format!("{} over time in s{which}", record.input.column());
            plot(text, &input, &run.t_s, &run.input, true)?;
            let (name, values) = match (&run.speed, &run.position, record.linear) {
                (Some(_), _, true) => ("v_m_s", speed(run)),
                (Some(_), _, false) => ("omega_rad_s", speed(run)),
                (None, position, true) => ("q_m", position.as_ref().map(Into::into)),
                (None, position, false) => ("theta_rad", position.as_ref().map(Into::into)),
            };
            let title = format!("{name} over time in s{which}");
            plot(text, &title, &run.t_s, &values.unwrap_or_default(), true)
        }
    }
}

/// A picture of braille dots; the labels are the least and the greatest value.
fn plot(text: &mut String, title: &str, x: &[f64], y: &[f64], lines: bool) -> std::fmt::Result {
    let points: Vec<(f32, f32)> = x.iter().zip(y).map(|(x, y)| (*x as f32, *y as f32)).collect();
    let ends = |pick: fn(&(f32, f32)) -> f32| {
        let least = points.iter().map(pick).fold(f32::INFINITY, f32::min);
        (least, points.iter().map(pick).fold(f32::NEG_INFINITY, f32::max))
    };
    let ((left, right), (low, high)) = (ends(|point| point.0), ends(|point| point.1));
    if left >= right || points.is_empty() {
        return Ok(());
    }
    let shape = if lines { Shape::Lines(&points) } else { Shape::Points(&points) };
    let (low, high) = if low < high { (low, high) } else { (low - 1.0, high + 1.0) };
    let label = || LabelFormat::Custom(Box::new(|value| short(f64::from(value))));
    let dots = PLOT.0 - 2 * (WIDTH - width()) as u32;
    let mut chart = Chart::new_with_y_range(dots, PLOT.1, left, right, low, high);
    let chart = chart.lineplot(&shape).x_label_format(label()).y_label_format(label());
    chart.axis();
    chart.figures();
    writeln!(text, "\n  {title}")?;
    for line in chart.to_string().lines().filter(|line| !line.trim().is_empty()) {
        let line: String = line.trim_end().chars().take(width() - 2).collect();
        writeln!(text, "  {line}")?;
    }
    Ok(())
}
