//! What the names leave.

use serde::Serialize;

/// What is left at the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Unexplained {
    /// Share of the first gap (squared, above the noise), 0 … 1.
    pub share_of_gap: f64,
    /// `none`, or its structure in words.
    pub structure: String,
    /// The variables on which it depends, if any predicts it on held-out data.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub depends_on: Vec<&'static str>,
    /// The share of it that they predict on held-out data, 0 … 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predicts_share: Option<f64>,
    /// True if repeats of the same input differ, or if nothing predicts it on held-out data. Absent where nothing is left, and
    /// where nobody could look.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_like: Option<bool>,
    /// The term without a name that describes it, if it lowers the gap of every held-out record.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unnamed: Option<UnnamedTerm>,
}

/// The word of the schema for a remainder in which nothing is to be seen.
const NONE: &str = "none";

impl Unexplained {
    /// True if something is left beside the names.
    pub fn is_left(&self) -> bool {
        self.structure != NONE
    }

    /// A share of the gap with its structure, if it has one.
    pub fn new(share_of_gap: f64, structure: Option<String>) -> Self {
        Self { share_of_gap, structure: structure.unwrap_or(NONE.into()), ..Self::default() }
    }
}

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
