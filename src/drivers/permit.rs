//! The two lines that may forbid motion: the driver's fault output and the enable (emergency stop) input.
//!
//! The fault output is an open drain that pulls its line low. The enable input has a pull-down and must be driven high by
//! the user's closed contact, so a broken wire there forbids motion; a broken fault wire does not.

use embedded_hal::digital::InputPin;
use serde::{Deserialize, Serialize};

/// What the lines say at this moment. A line that cannot be read counts as forbidding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Permit {
    /// Enable is high and the driver reports no fault.
    #[default]
    Granted = 0,
    /// The user's enable contact is open.
    Disabled = 1,
    /// The bridge driver reports a fault (over-current, over-temperature, under-voltage).
    BridgeFault = 2,
}

/// The two lines of one bridge.
pub struct PermitLines<F, E> {
    fault_n: F,
    enable: E,
}

impl<F: InputPin, E: InputPin> PermitLines<F, E> {
    /// `fault_n` is low in case of fault, `enable` is high for permission.
    pub fn new(fault_n: F, enable: E) -> Self {
        Self { fault_n, enable }
    }

    /// Reads both lines; an open enable contact is named first, since the person who opened it knows why.
    pub fn read(&mut self) -> Permit {
        let enabled = self.enable.is_high().unwrap_or(false);
        let healthy = self.fault_n.is_high().unwrap_or(false);
        match (enabled, healthy) {
            (false, _) => Permit::Disabled,
            (true, false) => Permit::BridgeFault,
            (true, true) => Permit::Granted,
        }
    }
}
