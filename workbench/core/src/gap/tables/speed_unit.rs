//! The unit of speed that a report of a table uses: that of the reader's file.

use crate::text::figures::figure;
use std::f64::consts::TAU;

/// The unit in which the reader's table counts speed.
#[derive(Clone, Copy, Debug)]
pub struct SpeedUnit {
    /// Name of the column.
    pub column: &'static str,
    /// Name of the unit.
    pub name: &'static str,
    /// One unit, rad/s.
    pub rad_s: f64,
}

impl SpeedUnit {
    /// Revolutions per minute if the file counts them, else rad/s.
    pub fn of(unit_rad_s: f64) -> Self {
        match (unit_rad_s - TAU / 60.0).abs() < 1e-9 {
            true => SpeedUnit { column: "speed_rpm", name: "rpm", rad_s: unit_rad_s },
            false => SpeedUnit { column: "omega_rad_s", name: "rad/s", rad_s: 1.0 },
        }
    }

    /// A speed with its unit.
    pub fn text(&self, omega: f64) -> String {
        format!("{} {}", figure(omega / self.rad_s), self.name)
    }
}
