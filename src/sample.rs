//! Both ends of a control tick: the raw integers that the board reads, and the state of the bridge that it drives.

use serde::{Deserialize, Serialize};

/// The raw integers that the board reads at the start of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sample {
    /// Encoder counter, wraps.
    pub count: i32,
    /// Supply voltage in converter counts, or [`Sample::VBUS_NOT_MEASURED`].
    pub vbus_raw: u16,
    /// Winding current in converter counts, or one of the marks `CURRENT_…`; see [`Sample::sensed`].
    pub current_raw: i16,
}

impl Sample {
    /// Nothing was read yet.
    pub const NONE: Self =
        Self { count: 0, vbus_raw: Self::VBUS_NOT_MEASURED, current_raw: Self::CURRENT_NOT_SENSED };
    /// Marks a supply that is not measured: the nominal voltage is used.
    pub const VBUS_NOT_MEASURED: u16 = u16::MAX;
    /// Marks a winding current that is not sensed.
    pub const CURRENT_NOT_SENSED: i16 = i16::MIN;
    /// Marks a current sensor whose zero is still looked for: the axis is not to be armed yet.
    pub const CURRENT_ZERO_SOUGHT: i16 = i16::MIN + 1;
    /// Marks a current sensor without zero: its readings at rest spread too far.
    pub const CURRENT_ZERO_UNSTEADY: i16 = i16::MIN + 2;
    /// Marks a current sensor without zero: its readings at rest are none of a sensor at rest.
    pub const CURRENT_ZERO_OUTSIDE: i16 = i16::MIN + 3;
    /// Marks a current sensor without zero: the bridge was not open long enough to look.
    pub const CURRENT_ZERO_UNSEEN: i16 = i16::MIN + 4;
    /// Lowest current that is no mark.
    pub const LOWEST_CURRENT: i16 = i16::MIN + 16;

    /// The current behind `current_raw` of a sample or a record; `None`: not sensed, for whatever reason.
    #[must_use]
    #[inline]
    pub const fn sensed(current_raw: i16) -> Option<i16> {
        if current_raw < Self::LOWEST_CURRENT { None } else { Some(current_raw) }
    }
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
