//! The two lines that may forbid motion: the driver's fault output and the enable (emergency stop) input.
//!
//! The fault output is an open drain that pulls its line low. The enable input has a pull-down and must be driven high by
//! the user's closed contact, so a broken wire there forbids motion; a broken fault wire does not.

use embedded_hal::digital::InputPin;

pub use crate::protect::Interlock;

/// The two lines of one bridge.
pub struct InterlockLines<F, E> {
    fault_n: F,
    enable: E,
}

impl<F: InputPin, E: InputPin> InterlockLines<F, E> {
    /// `fault_n` is low in case of fault, `enable` is high for permission.
    pub fn new(fault_n: F, enable: E) -> Self {
        Self { fault_n, enable }
    }

    /// Reads both lines; an open enable contact is named first, since the person who opened it knows why.
    pub fn read(&mut self) -> Interlock {
        let enabled = self.enable.is_high().unwrap_or(false);
        let healthy = self.fault_n.is_high().unwrap_or(false);
        match (enabled, healthy) {
            (false, _) => Interlock::Disabled,
            (true, false) => Interlock::BridgeFault,
            (true, true) => Interlock::Granted,
        }
    }
}
