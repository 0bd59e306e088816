//! The argument `--profile`: a motion to follow, or a voltage to apply.

use crate::device::feasible::Ability;
use crate::device::link::range_text;
use crate::device::session::{Profile, Task};
use crate::device::waypoints::Waypoint;
use anyhow::{Context, anyhow, bail, ensure};
use servo::config::Config;
use servo::identify::estimate::Estimates;
use servo::motion::excitation::{Sweep, Waveform};
use std::path::Path;

/// What the argument may be, for messages.
pub const SHAPES: &str = "sine:amp_rad,hz,seconds or step:amp_rad,seconds or file:CSV, or without a loop \
                          voltage_sine:amp_v,hz,seconds or chirp:amp_v,from_hz,to_hz,seconds or \
                          log_chirp:amp_v,from_hz,to_hz,seconds";

/// Reads the argument; a voltage is checked against the axis. `compensation`: of a motion that is followed.
pub fn task(text: &str, compensation: bool, config: &Config) -> anyhow::Result<Task> {
    let (kind, rest) = text.split_once(':').with_context(shape)?;
    let track = |profile| Ok(Task::Track { profile, compensation });
    if kind == "file" {
        return track(points(Path::new(rest))?);
    }
    let numbers: Vec<f32> = rest
        .split(',')
        .map(|part| part.trim().parse())
        .collect::<Result<_, _>>()
        .map_err(|_| anyhow!("--profile is `{text}`; {}", shape()))?;
    ensure!(numbers.iter().all(|number| number.is_finite()), "--profile holds a number that is not finite");
    if let ("sine", &[_, frequency_hz, _]) = (kind, numbers.as_slice()) {
        ensure!(frequency_hz > 0.0, "--profile {text}: a sine needs a frequency above 0 Hz ({})", shape());
    }
    let excite = |amplitude_v, from_hz, to_hz, sweep, seconds: f32| {
        let waveform =
            Waveform { amplitude_v, from_hz, to_hz, sweep, duration_ms: (seconds * 1000.0).round() as u32 };
        checked(&waveform, config).map(|()| Task::Excite(waveform))
    };
    match (kind, numbers.as_slice()) {
        ("sine", &[amplitude_rad, frequency_hz, seconds]) => {
            track(Profile::Sine { amplitude_rad, frequency_hz, seconds: lasting(seconds)? })
        }
        ("step", &[amplitude_rad, seconds]) => {
            track(Profile::Step { amplitude_rad, seconds: lasting(seconds)? })
        }
        ("voltage_sine", &[volts, hz, seconds]) => excite(volts, hz, hz, Sweep::Linear, seconds),
        ("chirp", &[volts, from, to, seconds]) => excite(volts, from, to, Sweep::Linear, seconds),
        ("log_chirp", &[volts, from, to, seconds]) => excite(volts, from, to, Sweep::Logarithmic, seconds),
        _ => bail!("--profile is `{text}`; {}", shape()),
    }
}

/// An error if no motor that agrees with the axis file can follow the motion. What a commissioning finds is asked again.
pub fn possible(motion: &Task, config: &Config) -> anyhow::Result<()> {
    let Task::Track { profile, .. } = motion else {
        return Ok(());
    };
    let ability = Ability::of(config, &Estimates::default());
    match ability.and_then(|ability| ability.shortfall(profile)) {
        Some(short) => bail!("{short}"),
        None => Ok(()),
    }
}

fn shape() -> String {
    format!("--profile must be {SHAPES}")
}

fn lasting(seconds: f32) -> anyhow::Result<f32> {
    ensure!(
        (0.01..=3600.0).contains(&seconds),
        "--profile lasts {seconds} s; it must last 0.01 to 3600 s ({})",
        shape()
    );
    Ok(seconds)
}

/// As the servo would, before anything runs.
fn checked(waveform: &Waveform, config: &Config) -> anyhow::Result<()> {
    let scale = config.build().map_err(|error| anyhow!(range_text(&error)))?;
    ensure!(
        config.travel_limit_rad.is_none(),
        "--profile applies a voltage, which no end stop bounds: only for an axis without axis.travel_limit_rad"
    );
    waveform.plan(&scale).map_err(|error| anyhow!("--profile: {}", range_text(&error)))?;
    Ok(())
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
    let (omega, alpha) = (place("omega_ref_rad_s").ok(), place("alpha_ref_rad_s2").ok());
    let mut points: Vec<Waypoint> = Vec::new();
    for (line, row) in (2..).zip(reader.records()) {
        let row = row.with_context(|| format!("{name}, line {line}: is not a row of the table"))?;
        let number = |column: usize| {
            row.get(column).and_then(|cell| cell.parse::<f64>().ok()).filter(|x| x.is_finite())
        };
        let (Some(t), Some(angle)) = (number(time), number(theta)) else {
            bail!("{name}, line {line}: t_s and theta_ref_rad must be finite numbers");
        };
        let further = |column: Option<usize>, what: &str| match column {
            None => Ok(None),
            Some(column) => number(column)
                .map(Some)
                .with_context(|| format!("{name}, line {line}: {what} must be a finite number")),
        };
        ensure!(
            points.last().is_none_or(|last| t > last.time_s),
            "{name}, line {line}: t_s does not increase; sort the rows by time"
        );
        points.push(Waypoint {
            time_s: t,
            theta_rad: angle,
            omega_rad_s: further(omega, "omega_ref_rad_s")?,
            alpha_rad_s2: further(alpha, "alpha_ref_rad_s2")?,
        });
    }
    ensure!(points.len() >= 2, "{name}: holds fewer than two points; a profile needs a beginning and an end");
    Ok(Profile::Points(points))
}
