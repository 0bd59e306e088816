//! The paper's own case: "Identification of Non-Linearities in an Autonomous Robot".
//!
//! Its motor (Fig. 1), its measured table of steady speeds (Table 3.1) and the inputs of its servo model (Tables 3.2, 3.3).
//! [`claims`] holds what the paper says beside what its own numbers say.

mod claims;

pub use claims::{claims, denominator, poles};

use truing_core::system::log::{self, Columns, Log, Table};
use truing_core::system::model::{self, Model};

/// Half-width of the paper's dead zone: 9 V in front of it, 7.8 V behind.
pub const DEAD_ZONE_V: f64 = 1.2;
/// The motor as published.
pub const MOTOR: &str = include_str!("../../../../../data/paper/motor.toml");
/// Table 3.1: voltage, V, and measured steady speed, rpm.
pub const TABLE_3_1: &str = include_str!("../../../../../data/paper/table-3.1-speed-vs-voltage.csv");
/// Table 3.2: the sine input, V over s.
pub const TABLE_3_2: &str = include_str!("../../../../../data/paper/table-3.2-sine-input.csv");
/// Table 3.3: the step input, V over s; blank before the step.
pub const TABLE_3_3: &str = include_str!("../../../../../data/paper/table-3.3-step-input.csv");

/// The paper's motor. The text is part of this program and of its tests.
pub fn motor() -> Model {
    model::parse("data/paper/motor.toml", MOTOR).expect("the paper's motor is a valid model")
}

/// The paper's measured table.
pub fn table() -> Table {
    match log::parse("data/paper/table-3.1-speed-vs-voltage.csv", TABLE_3_1, &Columns::default()) {
        Ok(Log::Table(table)) => table,
        _ => unreachable!("the paper's table is a valid steady-state table"),
    }
}

/// Time and voltage of one of the input tables; a blank voltage is 0.
pub fn input(text: &str) -> Vec<(f64, f64)> {
    let row = |line: &str| {
        let (t, u) = line.split_once(',')?;
        Some((t.parse().ok()?, u.trim().parse().unwrap_or(0.0)))
    };
    text.lines().skip(1).filter_map(row).collect()
}
