//! SysId, the identification of FRC: JSON with a list of rows for each test, as its logger wrote it.

use crate::naming;
use indexmap::IndexMap;
use serde::Deserialize;
use serde_json::Number;
use truing_core::system::log::cells::Cells;
use truing_core::system::log::{Bytes, Source};
use truing_core::text::input_error::InputError;

/// Data of SysId and of its predecessor `frc-characterization`.
pub struct SysId;

/// The tests, as far as they stand in the first bytes: keys are sorted, and a backward test is first.
const TESTS: [&str; 8] = [
    "\"fast-backward\"",
    "\"fast-forward\"",
    "\"slow-backward\"",
    "\"slow-forward\"",
    "\"dynamic-reverse\"",
    "\"dynamic-forward\"",
    "\"quasistatic-reverse\"",
    "\"quasistatic-forward\"",
];
/// How its files end.
const ENDING: &str = ".json";
/// Metres of a foot and of an inch.
const FOOT_M: f64 = 0.3048;
const INCH_M: f64 = 0.0254;

/// Columns of a drivetrain of SysId.
const DRIVE: [&str; 9] = [
    "t_s",
    "left_voltage",
    "right_voltage",
    "left_position",
    "right_position",
    "left_velocity",
    "right_velocity",
    "angle",
    "angular_rate",
];
/// Columns of `frc-characterization`.
const CHARACTERIZATION: [&str; 10] = [
    "t_s",
    "battery_voltage",
    "autospeed",
    "left_voltage",
    "right_voltage",
    "left_position",
    "right_position",
    "left_velocity",
    "right_velocity",
    "angle",
];

impl Source for SysId {
    fn takes(&self, name: &str, head: &[u8]) -> bool {
        let head = String::from_utf8_lossy(head);
        let opens = head.trim_start().starts_with('{') && name.to_lowercase().ends_with(ENDING);
        opens && TESTS.iter().any(|test| head.contains(test))
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let reader = (bytes.open)().map_err(|error| InputError::unreadable(bytes.name, error))?;
        let wrong = |what: String| InputError::file(bytes.name, what);
        let file: IndexMap<String, Value> = serde_json::from_reader(reader)
            .map_err(|why| wrong(format!("is no JSON of SysId: {why}; save it once more")))?;
        table(&file).map_err(wrong)
    }
}

/// A value of JSON; its numbers are of the type that is found among several whatever `serde_json` is built with.
#[derive(Deserialize)]
#[serde(untagged)]
enum Value {
    Rows(Vec<Vec<Number>>),
    Number(Number),
    Word(String),
    Other(serde::de::IgnoredAny),
}

fn table(file: &IndexMap<String, Value>) -> Result<Cells, String> {
    let tests: Vec<Test> = file
        .iter()
        .filter_map(|(name, value)| match value {
            Value::Rows(rows) if !rows.is_empty() => Some((name.as_str(), rows.as_slice())),
            _ => None,
        })
        .collect();
    let scale = Scale::of(file)?;
    let width = tests.first().map_or(0, |test| test.1[0].len());
    let names: Vec<&str> = match width {
        4 => vec!["t_s", "u_v", scale.position, scale.speed],
        9 => DRIVE.to_vec(),
        10 => CHARACTERIZATION.to_vec(),
        _ => {
            return Err(format!(
                "holds rows of {width} numbers; expected 4 (time, voltage, position, velocity), 9 or 10 (drivetrain)"
            ));
        }
    };
    let mut columns = columns(&tests, width)?;
    for column in
        names.iter().zip(&mut columns[1..]).filter(|pair| scale.holds_for(pair.0)).map(|pair| pair.1)
    {
        column.iter_mut().for_each(|value| *value *= scale.factor);
    }
    let listed: Vec<String> = tests.iter().enumerate().map(|(k, test)| format!("{k} {}", test.0)).collect();
    let told = [format!("Runs: {}. {}", listed.join(", "), scale.told)];
    let named = std::iter::once("run").chain(names).map(str::to_owned);
    let columns = named.zip(columns.into_iter().map(naming::column)).collect();
    let mut cells = naming::table(columns, "SysId JSON", &told)?;
    for (unit, name) in cells.units.iter_mut().zip(&cells.header) {
        *unit = unit_of(name, &scale).map(str::to_owned);
    }
    Ok(cells)
}

/// A test: its name and its rows.
type Test<'a> = (&'a str, &'a [Vec<Number>]);

/// The number of the test, and the numbers of its rows.
fn columns(tests: &[Test], width: usize) -> Result<Vec<Vec<f64>>, String> {
    let mut columns = vec![Vec::new(); width + 1];
    for (run, (name, rows)) in tests.iter().enumerate() {
        for (k, row) in rows.iter().enumerate() {
            if row.len() != width {
                return Err(format!("row {} of `{name}` holds {} numbers, others {width}", k + 1, row.len()));
            }
            columns[0].push(run as f64);
            let numbers = row.iter().map(|value| value.as_f64().unwrap_or(f64::NAN));
            columns[1..].iter_mut().zip(numbers).for_each(|(column, value)| column.push(value));
        }
    }
    Ok(columns)
}

/// What stands below the names of a drivetrain.
fn unit_of(name: &str, scale: &Scale) -> Option<&'static str> {
    match name {
        _ if name.ends_with("voltage") => Some("V"),
        _ if name.ends_with("position") => Some(scale.units.0),
        _ if name.ends_with("velocity") => Some(scale.units.1),
        _ => None,
    }
}

/// What positions and speeds are multiplied by: rows count turns, and the file says how many units a turn is.
struct Scale {
    factor: f64,
    position: &'static str,
    speed: &'static str,
    units: (&'static str, &'static str),
    told: String,
}

impl Scale {
    /// The column counts turns.
    fn holds_for(&self, name: &str) -> bool {
        [self.position, self.speed].contains(&name)
            || name.ends_with("position")
            || name.ends_with("velocity")
    }

    fn of(file: &IndexMap<String, Value>) -> Result<Self, String> {
        let a_turn = match file.get("unitsPerRotation") {
            Some(Value::Number(factor)) => factor.as_f64().unwrap_or(1.0),
            Some(Value::Word(word)) => {
                naming::number(word).ok_or_else(|| format!("`unitsPerRotation`: `{word}` is not a number"))?
            }
            _ => 1.0,
        };
        let unit = match file.get("units") {
            Some(Value::Word(word)) => word.as_str(),
            _ => "Rotations",
        };
        let turning = ("theta_rev", "omega_rev_s", ("rev", "rev/s"));
        let linear = ("q_m", "v_m_s", ("m", "m/s"));
        let (unit_factor, (position, speed, units)) = match unit.to_lowercase().as_str() {
            "meters" => (1.0, linear),
            "feet" => (FOOT_M, linear),
            "inches" => (INCH_M, linear),
            "radians" => (1.0, ("theta_rad", "omega_rad_s", ("rad", "rad/s"))),
            "degrees" => (1.0, ("theta_deg", "omega_deg_s", ("deg", "deg/s"))),
            "rotations" => (1.0, turning),
            other => {
                return Err(format!(
                    "`units`: `{other}` is not known; write Meters, Radians, Degrees or Rotations"
                ));
            }
        };
        let factor = a_turn * unit_factor;
        let told = format!("Positions and velocities are the logged turns times {factor} {}.", units.0);
        Ok(Self { factor, position, speed, units, told })
    }
}
