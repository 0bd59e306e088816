//! What one count of a board's converters is worth: a fact of its resistors, which no configuration may contradict.
//!
//! A limit in amperes or volts acts at a count of the converter. Were the configuration's scale another one than the board's,
//! every limit would act somewhere else.

pub use crate::config::ScaleError;
use crate::config::{Config, Field};
use crate::optional::Optional;

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
    let Some(board) = board.get() else { return Ok(()) };
    let off = (given - board).abs();
    // A number that is none is not near.
    if off.is_nan() || off > TOLERANCE * board { Err(ScaleError { field, given, board }) } else { Ok(()) }
}
