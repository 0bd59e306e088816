//! A measured log: what was applied, what was measured. SI units inside, whatever the file's columns were called.
//!
//! Row k holds the input from its own time to the next row's time (zero-order hold) and the outputs *at* its own time.

pub mod answer;
mod bridging;
pub mod cells;
mod clock;
mod column_plan;
mod columns;
mod dialect;
mod extent;
mod felt;
mod folded;
mod formula;
mod json;
mod layout;
mod lists;
pub mod look;
mod meaning;
mod mend;
mod names;
mod next_time;
mod open;
mod pieces;
mod propose;
mod quantities;
mod rates;
mod read;
mod records;
mod settled;
mod source;
mod spelling;
mod steps;
mod strays;
mod stream;
mod text;
mod text_table;
mod time_line;
mod topics;
mod words;

pub use columns::Columns;
pub use mend::{Names, Theirs};
pub use names::Quantity;
pub use open::{input, parse, parse_bytes, reading};
use servo::axis::Bridge;
pub use source::{Bytes, Source};
pub use spelling::{in_digits, in_shell, short};
pub use steps::median;

/// What drives the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Terminal voltage, V.
    Voltage,
    /// Winding current, A, held by a current loop.
    Current,
    /// Torque, N m.
    Torque,
    /// Force, N (a linear axis).
    Force,
}

impl Input {
    /// The column's name in messages and JSON.
    pub fn column(self) -> &'static str {
        match self {
            Self::Voltage => "u_v",
            Self::Current => "current_a",
            Self::Torque => "torque_nm",
            Self::Force => "force_n",
        }
    }

    /// Unit of the column.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Voltage => "V",
            Self::Current => "A",
            Self::Torque => "N m",
            Self::Force => "N",
        }
    }
}

/// A log, and how it was read.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The log.
    pub log: Log,
    /// What was recognised and what was bridged, in sentences.
    pub notes: Vec<String>,
}

/// A log of either shape.
#[derive(Clone, Debug, derive_more::From)]
pub enum Log {
    /// A record over time.
    Dynamic(Dynamic),
    /// Steady states: no time column.
    Table(Table),
}

/// A record over time.
#[derive(Clone, Debug)]
pub struct Dynamic {
    /// File name, for messages.
    pub source: String,
    /// What `Run::input` is.
    pub input: Input,
    /// True on a linear axis: positions in m, speeds in m/s.
    pub linear: bool,
    /// Continuous pieces; each starts anew.
    pub runs: Vec<Run>,
    /// How the file calls its columns.
    pub names: Names,
}

/// One continuous piece of a record. All columns have the same length.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// The number in the `run` column, else 0.
    pub id: i64,
    /// Time, s, strictly increasing.
    pub t_s: Vec<f64>,
    /// The input, held until the next row.
    pub input: Vec<f64>,
    /// State of the bridge, held until the next row.
    pub bridge: Vec<Bridge>,
    /// Position, rad or m.
    pub position: Option<Vec<f64>>,
    /// Speed as the model's `[sensors]` declare it, rad/s or m/s.
    pub speed: Option<Vec<f64>>,
    /// Winding current, A.
    pub current_a: Option<Vec<f64>>,
    /// Supply voltage, V.
    pub supply_v: Option<Vec<f64>>,
}

/// Steady states: input held until the speed settled.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// File name, for messages.
    pub source: String,
    /// Voltage, V.
    pub u_v: Vec<f64>,
    /// Settled speed, rad/s.
    pub omega_rad_s: Vec<f64>,
    /// One unit of the file's speed column, rad/s (rpm: 2π/60): the unit in which a reader thinks.
    pub speed_unit_rad_s: f64,
    /// How the file calls its columns.
    pub names: Names,
}

impl Dynamic {
    /// Rows of all runs together.
    pub fn rows(&self) -> usize {
        self.runs.iter().map(Run::rows).sum()
    }
}

impl Run {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.t_s.len()
    }

    /// The usual time between rows: the median; 0 without two rows.
    pub fn sample_s(&self) -> f64 {
        let mut steps: Vec<f64> = self.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        median(&mut steps)
    }
}
