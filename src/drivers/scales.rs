//! What one count of a board's converters is worth: a fact of its resistors, which no configuration may contradict.
//!
//! A limit in amperes or volts acts at a count of the converter. Were the configuration's scale another one than the board's,
//! every limit would act somewhere else.

use crate::config::{Config, Field};
use crate::optional::Optional;
use serde::{Deserialize, Serialize};

/// A configuration may differ by this share: what shunts, dividers and amplifiers of a board differ by, so that a board
/// may be calibrated. Shunts of 1 %, dividers of 1 % and amplifiers of a few per cent stay below.
const TOLERANCE: f32 = 0.1;

/// What one count is worth. None: the configuration says it, or there is no such sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scales {
    /// Volts of supply.
    pub supply: Optional,
    /// Amperes of winding current.
    pub current: Optional,
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

impl Scales {
    /// Refuses a configuration whose scales are more than a tenth off.
    ///
    /// # Errors
    /// The first one that is, with both numbers.
    pub fn allow(&self, config: &Config) -> Result<(), ScaleError> {
        near(Field::VbusPerLsb, config.vbus_v_per_lsb, self.supply)?;
        near(Field::CurrentPerLsb, config.current_a_per_lsb, self.current)
    }
}

fn near(field: Field, given: f32, board: Optional) -> Result<(), ScaleError> {
    match board.get() {
        // Written so that a number that is none is not near.
        Some(board) if !((given - board).abs() <= TOLERANCE * board) => {
            Err(ScaleError { field, given, board })
        }
        _ => Ok(()),
    }
}
