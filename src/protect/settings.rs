//! What the user may choose about protection.

use super::action::{Actions, Forbidden};
use super::thermal::Thermal;
use crate::config::ConfigError;
use serde::{Deserialize, Serialize};

/// The choices, in SI units. The default opens the bridge on every fault, has no thermal model and no time-out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// What is done about each fault.
    pub actions: Actions,
    /// I²t; `None`: no thermal model.
    pub thermal: Option<Thermal>,
    /// Longest silence of the host while voltage, speed or a moving position set-point is in force, ms; 0: any.
    pub command_timeout_ms: u16,
}

/// Why settings cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SettingsError {
    /// This fault cannot be answered so.
    Action(Forbidden),
    /// A value is out of range.
    Value(ConfigError),
}

impl Settings {
    pub(super) fn check(&self) -> Result<(), SettingsError> {
        self.actions.forbidden().map_or(Ok(()), |pair| Err(SettingsError::Action(pair)))
    }
}
