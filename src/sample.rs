//! Both ends of a control tick: the raw integers that the board reads, and the state of the bridge that it drives.

use serde::{Deserialize, Serialize};

/// The raw integers that the board reads at the start of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sample {
    /// Encoder counter, wraps.
    pub count: i32,
    /// Supply voltage in converter counts, or [`Sample::VBUS_NOT_MEASURED`].
    pub vbus_raw: u16,
    /// Winding current in converter counts, or [`Sample::CURRENT_NOT_SENSED`].
    pub current_raw: i16,
}

impl Sample {
    /// Nothing was read yet.
    pub const NONE: Self = Self {
        count: 0,
        vbus_raw: Self::VBUS_NOT_MEASURED,
        current_raw: Self::CURRENT_NOT_SENSED,
    };
    /// Marks a supply that is not measured: the nominal voltage is used.
    pub const VBUS_NOT_MEASURED: u16 = u16::MAX;
    /// Marks a winding current that is not sensed.
    pub const CURRENT_NOT_SENSED: i16 = i16::MIN;
}

/// State of the H-bridge. Numbers as in the log column `bridge`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Bridge {
    /// All switches off: the winding current is zero. The safe state.
    #[default]
    Open = 0,
    /// PWM drives the winding.
    Driven = 1,
    /// Both terminals tied together: 0 V, the motor brakes.
    Shorted = 2,
}
