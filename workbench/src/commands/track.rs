//! `truing track`: the firmware follows a profile; how well?

use super::commission::{self, Knowledge};
use super::firmware::Firmware;
use crate::loops::LoopShape;
use crate::motor::write_whole;
use crate::servo_link::advisory_text;
use crate::session::{Done, Profile, Task};
use crate::tracking::TrackJson;
use anyhow::{Context, bail, ensure};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

/// On or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// With the inverse dead zone.
    On,
    /// Without.
    Off,
}

/// Arguments of `truing track`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Which servo.
    #[command(flatten)]
    pub firmware: Firmware,
    /// What is known about the motor.
    #[command(flatten)]
    pub knowledge: Knowledge,
    /// Length of the commissioning, s.
    #[arg(long, default_value_t = 5.0)]
    pub budget_s: f64,
    /// sine:amp_rad,hz,seconds or step:amp_rad,seconds or file:CSV with the columns t_s and theta_ref_rad.
    #[arg(long)]
    pub profile: String,
    /// Use the inverse dead zone.
    #[arg(long, value_enum, default_value = "on")]
    pub compensation: Switch,
    /// Write the result as JSON, schema truing-track/1.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write every control tick as a log in format 1.
    #[arg(long)]
    pub log: Option<PathBuf>,
}

/// Runs and reports.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let config = arguments.firmware.axis()?;
    let first = arguments
        .knowledge
        .tasks(arguments.budget_s, arguments.firmware.seed, &config)?;
    let track = Task::Track {
        profile: profile(&arguments.profile)?,
        compensation: arguments.compensation == Switch::On,
    };
    let tasks: Vec<Task> = first.into_iter().chain([track]).collect();
    let result = arguments.firmware.run(config, &tasks)?;
    if arguments.knowledge.is_learned() {
        let report = commission::outcome(&result, &config)?;
        commission::print(&report);
        if let Some(refused) = report.refused {
            bail!(
                "the commissioning was refused ({}): {}",
                refused.code,
                refused.text
            );
        }
    }
    let Some(Done::Tracked(span)) = result.done.last() else {
        bail!("the servo has not tracked; run it again with --verbose");
    };
    let known = match (result.done.first(), tasks.first()) {
        (Some(Done::Commissioned(outcome)), _) => Some(&outcome.estimates),
        (_, Some(Task::Adopt(estimates))) => Some(&**estimates),
        _ => None,
    };
    if let Some(shape) = known.and_then(|known| LoopShape::of(&config, known).ok().flatten()) {
        println!(
            "{:21} crossover {:.1} rad/s, phase margin {:.0}°",
            "position loop", shape.crossover_rad_s, shape.phase_margin_deg
        );
    }
    let report = TrackJson::new(&result.log, span);
    println!(
        "{:21} {:.6} rad, peak {:.6} rad",
        "position error, rms", report.position_rms_rad, report.position_peak_rad
    );
    println!(
        "{:21} {:.4} rad/s, peak {:.4} rad/s",
        "speed error, rms", report.speed_rms_rad_s, report.speed_peak_rad_s
    );
    let last = result.log.rows.last();
    if let Some(text) = last.and_then(|row| advisory_text(row.record.advisory)) {
        println!("{:21} {text}", "advisory");
    }
    if let Some(path) = &arguments.json {
        write_whole(path, &(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    if let Some(path) = &arguments.log {
        result.log.save(path)?;
    }
    Ok(())
}

/// The argument of `--profile`.
pub fn profile(text: &str) -> anyhow::Result<Profile> {
    let shape = "--profile must be sine:amp_rad,hz,seconds or step:amp_rad,seconds or file:CSV";
    let (kind, rest) = text.split_once(':').context(shape)?;
    if kind == "file" {
        return points(Path::new(rest));
    }
    let numbers: Vec<f32> = rest
        .split(',')
        .filter_map(|part| part.trim().parse().ok())
        .collect();
    ensure!(
        numbers.iter().all(|number| number.is_finite()),
        "--profile holds a number that is not finite"
    );
    let seconds = numbers.last().copied().unwrap_or(0.0);
    ensure!(
        (0.01..=3600.0).contains(&seconds),
        "--profile lasts {seconds} s; it must last 0.01 to 3600 s ({shape})"
    );
    match (kind, numbers.as_slice(), rest.split(',').count()) {
        ("sine", &[amplitude_rad, frequency_hz, seconds], 3) => Ok(Profile::Sine {
            amplitude_rad,
            frequency_hz,
            seconds,
        }),
        ("step", &[amplitude_rad, seconds], 2) => Ok(Profile::Step {
            amplitude_rad,
            seconds,
        }),
        _ => bail!("--profile is `{text}`; {shape}"),
    }
}

fn points(path: &Path) -> anyhow::Result<Profile> {
    let name = path.display();
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_path(path)
        .with_context(|| format!("{name}: cannot be read; check the path"))?;
    let headers = reader.headers()?.clone();
    let place = |column: &str| {
        let found = headers.iter().position(|header| header == column);
        found.with_context(|| format!("{name}: lacks the column {column}; expected t_s,theta_ref_rad"))
    };
    let (time, theta) = (place("t_s")?, place("theta_ref_rad")?);
    let mut points: Vec<(f64, f32)> = Vec::new();
    for (line, row) in (2..).zip(reader.records()) {
        let row = row.with_context(|| format!("{name}, line {line}: is not a row of the table"))?;
        let number = |column: usize| {
            row.get(column)
                .and_then(|cell| cell.parse::<f64>().ok())
                .filter(|x| x.is_finite())
        };
        let (Some(t), Some(angle)) = (number(time), number(theta)) else {
            bail!("{name}, line {line}: t_s and theta_ref_rad must be finite numbers");
        };
        ensure!(
            points.last().is_none_or(|last| t > last.0),
            "{name}, line {line}: t_s does not increase; sort the rows by time"
        );
        points.push((t, angle as f32));
    }
    ensure!(
        points.len() >= 2,
        "{name}: holds fewer than two points; a profile needs a beginning and an end"
    );
    Ok(Profile::Points(points))
}
