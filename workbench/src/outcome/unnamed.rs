//! What a result says of a term without a name.

use serde::Serialize;

/// A term without a name, as it stands in the extended model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnnamedTerm {
    /// Its name in the extended model.
    pub name: String,
    /// Its variables.
    pub over: Vec<&'static str>,
    /// The knots of each variable; between them the table is linear, outside constant.
    pub knots: Vec<Vec<f64>>,
    /// The unit of the knots of each variable.
    pub knot_units: Vec<&'static str>,
    /// On what it acts: `torque`, `input` or `reading`.
    pub acts: &'static str,
    /// The values, those of the last variable side by side.
    pub values: Vec<f64>,
    /// Their standard deviations; `None`: not determined.
    pub values_std: Vec<Option<f64>>,
    /// Their unit.
    pub unit: String,
    /// Speed below which no direction is certain.
    pub standstill_speed: f64,
    /// Root mean square of the held-out residual without it.
    pub gap_before: f64,
    /// Root mean square of the held-out residual with it.
    pub gap_after: f64,
}
