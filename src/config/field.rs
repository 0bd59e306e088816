//! What may be wrong with a number that arrives from outside.

use super::Field;
use serde::{Deserialize, Serialize};

/// Why a [`Config`](super::Config), or another number that arrives, cannot be: names the field as `axis.toml` spells it, and the range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConfigError {
    /// The field.
    pub field: Field,
    /// Smallest value allowed.
    pub minimum: f32,
    /// Largest value allowed.
    pub maximum: f32,
}

/// A scale that is not the board's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScaleError {
    /// [`Field::VbusPerLsb`] or [`Field::CurrentPerLsb`].
    pub field: Field,
    /// What the configuration says.
    pub given: f32,
    /// What the board has.
    pub board: f32,
}

/// Refuses a number outside its range; NaN is never within.
pub(crate) fn within(field: Field, value: f32, minimum: f32, maximum: f32) -> Result<(), ConfigError> {
    if value >= minimum && value <= maximum { Ok(()) } else { Err(ConfigError { field, minimum, maximum }) }
}
