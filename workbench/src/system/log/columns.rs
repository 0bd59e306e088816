//! Which column of a file is which quantity: by name, by unit suffix, or by the user's `--columns`.

use crate::console::input_error::{InputError, nearest};
use std::f64::consts::{PI, TAU};
use std::str::FromStr;

/// A quantity that a log may carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Time, s.
    Time,
    /// Terminal voltage, V.
    Voltage,
    /// Duty −1 … 1, to be multiplied by the supply voltage.
    Duty,
    /// Current held by a current loop, A.
    CurrentInput,
    /// Torque, N m.
    Torque,
    /// Force, N.
    Force,
    /// Angle, rad.
    Angle,
    /// Position on a linear axis, m.
    Position,
    /// Angular speed, rad/s.
    AngularSpeed,
    /// Speed on a linear axis, m/s.
    LinearSpeed,
    /// 0 open, 1 driven, 2 shorted.
    Bridge,
    /// Measured winding current, A.
    Current,
    /// Measured supply voltage, V.
    Supply,
    /// Number of the run.
    Run,
}

/// Name of a column, the quantity, and the factor to its SI unit.
const NAMES: &[(&str, Quantity, f64)] = &[
    ("t_s", Quantity::Time, 1.0),
    ("time_s", Quantity::Time, 1.0),
    ("t_ms", Quantity::Time, 1e-3),
    ("t_us", Quantity::Time, 1e-6),
    ("u_v", Quantity::Voltage, 1.0),
    ("voltage_v", Quantity::Voltage, 1.0),
    ("u_mv", Quantity::Voltage, 1e-3),
    ("duty", Quantity::Duty, 1.0),
    ("current_a", Quantity::CurrentInput, 1.0),
    ("current_ma", Quantity::CurrentInput, 1e-3),
    ("torque_nm", Quantity::Torque, 1.0),
    ("tau_nm", Quantity::Torque, 1.0),
    ("force_n", Quantity::Force, 1.0),
    ("theta_rad", Quantity::Angle, 1.0),
    ("q_rad", Quantity::Angle, 1.0),
    ("theta_deg", Quantity::Angle, PI / 180.0),
    ("theta_rev", Quantity::Angle, TAU),
    ("q_m", Quantity::Position, 1.0),
    ("q_mm", Quantity::Position, 1e-3),
    ("omega_rad_s", Quantity::AngularSpeed, 1.0),
    ("w_rad_s", Quantity::AngularSpeed, 1.0),
    ("omega_deg_s", Quantity::AngularSpeed, PI / 180.0),
    ("omega_rpm", Quantity::AngularSpeed, TAU / 60.0),
    ("speed_rpm", Quantity::AngularSpeed, TAU / 60.0),
    ("v_m_s", Quantity::LinearSpeed, 1.0),
    ("v_mm_s", Quantity::LinearSpeed, 1e-3),
    ("bridge", Quantity::Bridge, 1.0),
    ("i_a", Quantity::Current, 1.0),
    ("i_ma", Quantity::Current, 1e-3),
    ("vbus_v", Quantity::Supply, 1.0),
    ("vbus_mv", Quantity::Supply, 1e-3),
    ("run", Quantity::Run, 1.0),
];

/// Where one quantity stands in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// The quantity.
    pub quantity: Quantity,
    /// Index of the column.
    pub index: usize,
    /// Factor to the SI unit.
    pub factor: f64,
}

/// The user's `--columns`: `ours=theirs[*factor],…`. `ours=none` ignores a column that the file has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns(Vec<Mapping>);

#[derive(Clone, Debug, PartialEq)]
struct Mapping {
    ours: String,
    theirs: String,
    factor: f64,
}

impl FromStr for Columns {
    type Err = InputError;

    fn from_str(text: &str) -> Result<Self, InputError> {
        let items = text.split(',').map(str::trim).filter(|item| !item.is_empty());
        Ok(Self(items.map(mapping).collect::<Result<_, _>>()?))
    }
}

fn mapping(item: &str) -> Result<Mapping, InputError> {
    let wrong = |what: String| InputError(format!("--columns, `{item}`: {what}"));
    let (ours, right) = item
        .split_once('=')
        .ok_or_else(|| wrong("write OUR_NAME=FILE_NAME or OUR_NAME=FILE_NAME*FACTOR".into()))?;
    let ours = ours.trim();
    if quantity_of(ours).is_none() {
        return Err(wrong(unknown(ours)));
    }
    let (theirs, factor) = match right.rsplit_once('*') {
        Some((theirs, factor)) => {
            (theirs, factor.trim().parse().ok().filter(|f: &f64| f.is_finite() && *f != 0.0))
        }
        None => (right, Some(1.0)),
    };
    let factor = factor.ok_or_else(|| wrong("the factor is not a number other than 0".into()))?;
    Ok(Mapping { ours: ours.to_owned(), theirs: theirs.trim().to_owned(), factor })
}

fn quantity_of(name: &str) -> Option<(Quantity, f64)> {
    let name = name.to_lowercase();
    NAMES.iter().find(|known| known.0 == name).map(|known| (known.1, known.2))
}

/// A sentence about a name that no quantity has.
fn unknown(name: &str) -> String {
    let near = nearest(name, NAMES.iter().map(|known| known.0)).unwrap_or("t_s");
    format!(
        "`{name}` is no known column; the nearest is `{near}` (SI units, for example u_v, theta_rad, omega_rad_s)"
    )
}

impl Columns {
    /// Finds every quantity that a header offers. What the user mapped goes before the names in the file.
    pub fn locate(&self, source: &str, header: &[String]) -> Result<Vec<Source>, InputError> {
        let mut found: Vec<Source> = Vec::new();
        for mapping in self.0.iter().filter(|mapping| mapping.theirs != "none") {
            let Some(index) = header.iter().position(|name| *name == mapping.theirs) else {
                let listed = header.join(", ");
                let what = format!(
                    "--columns names `{}`, which the header lacks (it has: {listed})",
                    mapping.theirs
                );
                return Err(InputError::line(source, 1, what));
            };
            let (quantity, unit) = quantity_of(&mapping.ours).expect("checked when parsed");
            found.push(Source { quantity, index, factor: unit * mapping.factor });
        }
        let hidden: Vec<_> =
            self.0.iter().filter_map(|mapping| Some(quantity_of(&mapping.ours)?.0)).collect();
        for (index, name) in header.iter().enumerate() {
            let Some((quantity, factor)) = quantity_of(name) else {
                continue;
            };
            if hidden.contains(&quantity) || found.iter().any(|known| known.index == index) {
                continue;
            }
            if let Some(twice) = found.iter().find(|known| known.quantity == quantity) {
                let what = format!(
                    "columns `{}` and `{name}` hold the same quantity; choose one with --columns",
                    header[twice.index]
                );
                return Err(InputError::line(source, 1, what));
            }
            found.push(Source { quantity, index, factor });
        }
        Ok(found)
    }

    /// The file's name of the time column, and its factor to seconds.
    pub fn time(&self) -> (&str, f64) {
        let of_time =
            |mapping: &&Mapping| quantity_of(&mapping.ours).is_some_and(|known| known.0 == Quantity::Time);
        self.0.iter().find(of_time).map_or(("t_s", 1.0), |mapping| {
            let unit = quantity_of(&mapping.ours).map_or(1.0, |known| known.1);
            (&mapping.theirs, unit * mapping.factor)
        })
    }

    /// What to say when a needed quantity is missing: the likeliest mistyped column, if there is one.
    pub fn missing(header: &[String], wanted: &str, stems: &[&str]) -> String {
        let near = header.iter().find(|name| {
            quantity_of(name).is_none() && stems.iter().any(|stem| name.to_lowercase().starts_with(stem))
        });
        let listed = header.join(", ");
        match near {
            Some(name) => format!(
                "no column {wanted}: `{name}` has an unknown unit or spelling; rename it or use --columns (header: {listed})"
            ),
            None => format!("no column {wanted}; rename one or use --columns (header: {listed})"),
        }
    }
}
