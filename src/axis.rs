//! One joint: the numbers that enter and leave a control tick.

use serde::{Deserialize, Serialize};

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
    /// Marks a supply that is not measured: the nominal voltage is used.
    pub const VBUS_NOT_MEASURED: u16 = u16::MAX;
    /// Marks a winding current that is not sensed.
    pub const CURRENT_NOT_SENSED: i16 = i16::MIN;
}

/// What the board does until the next tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Output {
    /// Bridge state; [`Bridge::Open`] by default.
    pub bridge: Bridge,
    /// Duty in PWM counts, −`pwm_full_scale` … +`pwm_full_scale`; positive gives positive torque.
    pub duty: i16,
}
