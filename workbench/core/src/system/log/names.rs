//! The columns of the format: their names, quantities and units.

use std::f64::consts::{PI, TAU};

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

/// Name of a column, the quantity, and the factor to its SI unit. The first name of a quantity and factor is the one that
/// is proposed.
const NAMES: &[(&str, Quantity, f64)] = &[
    ("t_s", Quantity::Time, 1.0),
    ("time_s", Quantity::Time, 1.0),
    ("t_ms", Quantity::Time, 1e-3),
    ("t_us", Quantity::Time, 1e-6),
    ("t_ns", Quantity::Time, 1e-9),
    ("u_v", Quantity::Voltage, 1.0),
    ("voltage_v", Quantity::Voltage, 1.0),
    ("u_mv", Quantity::Voltage, 1e-3),
    ("duty", Quantity::Duty, 1.0),
    ("duty_percent", Quantity::Duty, 1e-2),
    ("current_a", Quantity::CurrentInput, 1.0),
    ("current_ma", Quantity::CurrentInput, 1e-3),
    ("torque_nm", Quantity::Torque, 1.0),
    ("tau_nm", Quantity::Torque, 1.0),
    ("torque_mnm", Quantity::Torque, 1e-3),
    ("force_n", Quantity::Force, 1.0),
    ("theta_rad", Quantity::Angle, 1.0),
    ("q_rad", Quantity::Angle, 1.0),
    ("theta_deg", Quantity::Angle, PI / 180.0),
    ("theta_rev", Quantity::Angle, TAU),
    ("q_m", Quantity::Position, 1.0),
    ("q_cm", Quantity::Position, 1e-2),
    ("q_mm", Quantity::Position, 1e-3),
    ("omega_rad_s", Quantity::AngularSpeed, 1.0),
    ("w_rad_s", Quantity::AngularSpeed, 1.0),
    ("omega_deg_s", Quantity::AngularSpeed, PI / 180.0),
    ("omega_rpm", Quantity::AngularSpeed, TAU / 60.0),
    ("speed_rpm", Quantity::AngularSpeed, TAU / 60.0),
    ("omega_rev_s", Quantity::AngularSpeed, TAU),
    ("v_m_s", Quantity::LinearSpeed, 1.0),
    ("v_cm_s", Quantity::LinearSpeed, 1e-2),
    ("v_mm_s", Quantity::LinearSpeed, 1e-3),
    ("bridge", Quantity::Bridge, 1.0),
    ("i_a", Quantity::Current, 1.0),
    ("i_ma", Quantity::Current, 1e-3),
    ("vbus_v", Quantity::Supply, 1.0),
    ("vbus_mv", Quantity::Supply, 1e-3),
    ("run", Quantity::Run, 1.0),
];

/// The quantity and the factor of a name of ours.
pub fn quantity_of(name: &str) -> Option<(Quantity, f64)> {
    let name = name.to_lowercase();
    NAMES.iter().find(|known| known.0 == name).map(|known| (known.1, known.2))
}

/// All names of ours.
pub fn ours() -> impl Iterator<Item = &'static str> {
    NAMES.iter().map(|known| known.0)
}

/// Our name of a quantity in this unit.
pub fn name_of(quantity: Quantity, factor: f64) -> &'static str {
    let of = |wanted: f64| NAMES.iter().find(|known| known.1 == quantity && known.2 == wanted);
    of(factor).or_else(|| of(1.0)).expect("every quantity has a name in its SI unit").0
}
