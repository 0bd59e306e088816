//! What an axis answers: why a command was refused, and what there is to tell.

use crate::commission::CommissionReport;
use crate::config::{ConfigError, ScaleError};
use crate::protect::{Fault, SettingsError};
use crate::record::Activity;
use serde::{Deserialize, Serialize};

/// Why a command was not carried out. Nothing has changed then. The variants travel by their number: append new ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Refusal {
    /// The configuration cannot be.
    Config(ConfigError),
    /// The board's timer cannot make this control rate from this PWM scale.
    TickRate,
    /// No configuration has arrived yet.
    NotConfigured,
    /// Allowed only while the bridge is open.
    BridgeDriven,
    /// Its sequence number is older than one already executed; the next one expected is given.
    Stale {
        /// The next number.
        expected: u16,
    },
    /// This image has fewer axes.
    NoSuchAxis,
    /// The axes of one chip share control rate, PWM scale and PWM delay, and another axis has others.
    SharedTick,
    /// Parameters are being stored: nothing but `Stop` and questions until [`crate::link::protocol::Message::Store`] tells the end.
    Storing,
    /// Parameters are stored only while every bridge is open and every shaft stands.
    NotAtRest,
    /// A set of parameters cannot be.
    Parameters(SettingsError),
    /// The configuration has another scale of current or supply than the board.
    Scale(ScaleError),
    /// Torque needs `Arm` first.
    NotArmed,
    /// A fault is latched; clear it with `Stop`.
    Faulted,
    /// Gain and time constant are neither identified nor configured: commission, or give `time_constant_hint_s`.
    NotIdentified,
    /// Something else is running: stop it first.
    Busy,
    /// The target lies beyond the end stops.
    BeyondTravel,
    /// Amplitude, frequency or duration cannot be done at this control rate.
    OutOfRange,
    /// Not a command of the axis: the link answers it.
    NotForAxis,
    /// Absolute targets need a reference.
    NotReferenced,
    /// A parameter is out of range; the error names it.
    Value(ConfigError),
    /// So many streamed points wait already: send this one again later.
    StreamFull,
    /// The zero of the current sensor is still looked for, which takes a bounded time with the bridge open: ask again.
    CurrentZeroSought,
    /// The motion takes more voltage than is left beyond the dead zone.
    BeyondVoltage {
        /// What it takes at its peak, V.
        needed_v: f32,
        /// What the limit, the supply and the saturation leave, V.
        available_v: f32,
    },
    /// The motion is faster than the speed limit lets the loops go.
    BeyondSpeed {
        /// Its peak speed, rad/s.
        needed_rad_s: f32,
        /// The fastest that is followed, rad/s.
        available_rad_s: f32,
    },
}

impl From<ConfigError> for Refusal {
    fn from(error: ConfigError) -> Self {
        Refusal::Config(error)
    }
}

impl From<ScaleError> for Refusal {
    fn from(error: ScaleError) -> Self {
        Refusal::Scale(error)
    }
}

/// What there is to tell about an axis, in SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// What it is doing.
    pub activity: Activity,
    /// The latched fault.
    pub fault: Fault,
    /// Progress of the commissioning, 0 … 255; `None` when none is running.
    pub progress: Option<u8>,
    /// How the last commissioning ended.
    pub commissioning: Option<CommissionReport>,
}
