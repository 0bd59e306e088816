//! What a result says against the model file.

use serde::Serialize;

/// A base parameter that the log contradicts: it lies further off than its tolerance allows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contradiction {
    /// Its key in the model file.
    pub parameter: String,
    /// What the log says over what the file says.
    pub ratio: f64,
    /// One standard deviation of the ratio; `None`: not determined.
    pub std: Option<f64>,
    /// What the file says, in the unit of the key.
    pub stated: f64,
    /// What the log says.
    pub fitted: f64,
    /// Fit of the held-out data with the base parameters put right and nothing added, %; absent where an effect was named before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit_percent: Option<f64>,
    /// Parameters that explain the log as well in its place.
    pub or: Vec<String>,
    /// Lines of the model file, each of which mends it.
    pub mends: Vec<String>,
}
