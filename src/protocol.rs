//! What host and servo say to each other.

use crate::config::Config;
use serde::{Deserialize, Serialize};

/// A request of the host.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Set the axis up. Refused while the bridge is not open.
    Configure(Config),
    /// Allow the bridge to be driven.
    Arm,
    /// Switch the bridge off, from any state.
    Stop,
    /// Excite, identify, verify. `seed` orders the excitation.
    Commission {
        /// Length of the excitation, ms.
        budget_ms: u32,
        /// Orders the excitation.
        seed: u32,
    },
    /// Use the inverse dead zone in the loops, or do not.
    Compensation(bool),
    /// Track `amplitude · sin(2π f t)` in position, for a time; smooth start.
    TrackSine {
        /// Amplitude, rad at the controlled shaft.
        amplitude_rad: f32,
        /// Frequency, Hz.
        frequency_hz: f32,
        /// Duration, ms.
        duration_ms: u32,
    },
    /// Hold this position from now on, rad relative to the position at power-up.
    Position(f32),
}
