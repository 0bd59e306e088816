//! The text of a model file, each line with a comment that says where its number comes from.

use super::sheet::{KE, Number, Sheet};
use std::fmt::Write;
use truing_core::gap::start_values::{GUESSED, START as ESTIMATED};
use truing_core::system::model::{ELECTRICAL, Kind, Model, VISCOUS_V};

/// What stands behind a number that nobody knows.
const UNKNOWN: &str = "unknown: fitted to the log with a wide prior";
/// The numbers of a motor that every motor has, each with its unit and its meaning. Friction is all that a log of torques or currents has for
/// a time constant; beside a back-EMF it shows, like the winding, in a measured current alone.
const MOTOR: [(&str, &str); 5] = [
    ("R_ohm", "resistance of winding, brushes and leads, Ω"),
    ("Kt_nm_per_a", "torque constant, N m/A = V s/rad"),
    ("J_kgm2", "inertia of rotor, gear and load, kg m²"),
    ("b_nms_per_rad", "viscous friction, N m s/rad"),
    ("L_h", "inductance of the winding, H"),
];
/// Column at which comments begin.
const COLUMN: usize = 34;
/// Columns of a terminal, without the two by which the file is shown indented.
const WIDTH: usize = 78;
/// Relative tolerance of a number that is not known (1 σ of the logarithm).
const WIDE: f64 = 1.0;

/// What else goes into the file.
pub struct Found<'a> {
    /// The model with what the log says, if there is a log.
    pub model: Option<&'a Model>,
    /// So many of a motor's numbers the log shows, in the order of [`MOTOR`].
    pub shown: usize,
    /// The log shows settled speeds alone.
    pub settled: bool,
    /// The window of the speed, s, and where it was found.
    pub window: Option<(f64, &'static str)>,
    /// The log, for the first comment.
    pub log: Option<String>,
    /// What its columns are, where their names do not say it.
    pub columns: String,
}

/// The whole file.
pub fn file(sheet: &Sheet, found: &Found) -> String {
    let mut text = String::from("# Written by `truing start`. Every key: docs/model.md\n");
    line(&mut text, "schema = \"truing-model/1\"", "");
    match found.model.map(|model| model.kind) {
        Some(Kind::FirstOrder { .. }) => first_order(&mut text, sheet, found),
        Some(Kind::Inertia { inertia, viscous, .. }) => linear(&mut text, inertia, viscous),
        _ => motor(&mut text, sheet, found),
    }
    surroundings(&mut text, sheet, found);
    text
}

/// A comment that would leave the screen goes before its entry.
fn line(text: &mut String, entry: &str, comment: &str) {
    let beside = COLUMN.max(entry.chars().count()) + 3 + comment.chars().count();
    let _ = match comment {
        "" => writeln!(text, "{entry}"),
        comment if beside > WIDTH => writeln!(text, "# {comment}\n{entry}"),
        comment => writeln!(text, "{entry:COLUMN$} # {comment}"),
    };
}

/// The log does not tell resistance, torque constant and inertia apart.
fn first_order(text: &mut String, sheet: &Sheet, found: &Found) {
    text.push_str("\n[model]\n");
    line(text, "kind = \"first_order\"", "R, Kt and J show only with a current");
    line(text, "fitted_to_log = true", "the numbers are the log's own");
    let numbers = found.model.map(Model::parameters).unwrap_or_default();
    for (key, number) in numbers.into_iter().filter(|(_, number)| *number > 0.0) {
        let why = match key {
            "time_constant_s" if found.settled => GUESSED,
            VISCOUS_V => "a guess; rows with an open bridge show it",
            ELECTRICAL => "L/R of the winding, a guess; fitted within a factor of four",
            _ => ESTIMATED,
        };
        line(text, &format!("{key} = {}", digits(number)), why);
    }
    let known = sheet.numbers();
    if !known.is_empty() {
        text.push_str("# Known, and not enough for kind = \"dc_motor\", which takes two of R_ohm,\n# Kt_nm_per_a and J_kgm2.\n");
        for number in known {
            line(text, &format!("# {} = {}", number.key, digits(number.value)), &number.origin);
        }
    }
    text.push_str("\n[motor]\n");
    gear(text, sheet);
}

/// The axis moves along a line.
fn linear(text: &mut String, mass: f64, viscous: f64) {
    text.push_str("\n[model]\n");
    line(text, "kind = \"inertia\"", "M dv/dt = drive_gain u − viscous v");
    line(text, "fitted_to_log = true", "the numbers are the log's own");
    text.push_str("\n[motor]\n");
    line(text, &format!("mass_kg = {}", digits(mass)), ESTIMATED);
    line(text, &format!("viscous = {}", digits(viscous)), ESTIMATED);
    line(text, "drive_gain = 1.0", "mass and forces count per unit of the input");
}

fn motor(text: &mut String, sheet: &Sheet, found: &Found) {
    let asked = &MOTOR[..found.shown];
    text.push_str("\n[model]\n");
    line(text, "kind = \"dc_motor\"", "L di/dt = u − R i − Ke ω; J dω/dt = Kt i − b ω");
    text.push_str("\n[motor]\n");
    let known = sheet.numbers();
    let estimated = |key: &str| {
        let parameters = found.model.map(Model::parameters).unwrap_or_default();
        parameters.into_iter().find(|(name, _)| *name == key).map(|(_, value)| value)
    };
    for &(key, meaning) in asked {
        let given = known.iter().find(|number| number.key == key);
        match (given, estimated(key)) {
            (Some(number), _) => entry(text, number),
            (None, Some(value)) => line(text, &format!("{key} = {}", digits(value)), ESTIMATED),
            (None, None) => line(text, &format!("{key} = \"unknown\""), &format!("{meaning}; {UNKNOWN}")),
        }
    }
    known.iter().filter(|number| number.key == KE).for_each(|number| entry(text, number));
    gear(text, sheet);
    tolerances(text, asked, &known);
}

fn entry(text: &mut String, number: &Number) {
    line(text, &format!("{} = {}", number.key, digits(number.value)), &number.origin);
}

fn gear(text: &mut String, sheet: &Sheet) {
    let turns = sheet.gear.filter(|_| !sheet.encoder_at_output).unwrap_or(1.0);
    line(text, &format!("gear_ratio = {}", digits(turns)), "encoder turns per turn of the load");
}

fn tolerances(text: &mut String, asked: &[(&str, &str)], known: &[Number]) {
    text.push_str("\n[tolerance]\n");
    line(text, "default = 0.05", "relative, one standard deviation");
    for (key, _) in asked {
        let given = known.iter().find(|number| number.key == *key);
        let (tolerance, why) = match given {
            Some(number) if number.tolerance >= WIDE => (number.tolerance, "the load is on no label"),
            Some(number) => (number.tolerance, "as well as a label tells it"),
            None => (WIDE, "unknown"),
        };
        line(text, &format!("{key} = {tolerance:?}"), why);
    }
}

fn surroundings(text: &mut String, sheet: &Sheet, found: &Found) {
    if let Some(volts) = sheet.voltage {
        text.push_str("\n[supply]\n");
        line(text, &format!("nominal_v = {}", digits(volts)), "given; the drive cannot give more");
    }
    if let Some(counts) = sheet.counts_per_rev {
        text.push_str("\n[encoder]\n");
        line(text, &format!("counts_per_rev = {}", digits(counts)), "given; after ×4 decoding");
        line(
            text,
            &format!("side = \"{}\"", if sheet.encoder_at_output { "load" } else { "motor" }),
            "the shaft that carries it",
        );
    }
    if let Some((seconds, origin)) = found.window {
        text.push_str("\n[sensors]\n");
        line(text, "speed = \"encoder_difference_causal\"", "the speed is late by half its window");
        line(text, &format!("speed_window_s = {}", digits(seconds)), origin);
    }
    if let Some(volts) = sheet.friction_v() {
        let volts = digits(volts);
        let _ = writeln!(
            text,
            "\n# The no-load current holds a friction of about {volts} V at the terminals (R I0).\n# It is not stated here: `truing gap` finds the friction that the log shows."
        );
    }
    if !found.columns.is_empty() {
        let columns = toml::Value::from(found.columns.as_str());
        let _ = writeln!(
            text,
            "\n[log]\n# what `gap` reads a log by, if no --columns is given\ncolumns = {columns}"
        );
    }
    if let Some(log) = &found.log {
        let _ = writeln!(text, "# The log: {log}");
    }
}

/// Four digits, as TOML reads them.
fn digits(value: f64) -> String {
    format!("{:?}", truing_core::text::figures::rounded(value, 4))
}
