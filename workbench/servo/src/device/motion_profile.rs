//! What a motor is to follow.

use crate::device::waypoints::Waypoint;

/// What to follow.
#[derive(Clone, Debug, PartialEq)]
pub enum Profile {
    /// `amplitude · sin(2π f t)`, eased in and out.
    Sine {
        /// rad.
        amplitude_rad: f32,
        /// Hz.
        frequency_hz: f32,
        /// s.
        seconds: f32,
    },
    /// A jump.
    Step {
        /// rad, from where the axis is.
        amplitude_rad: f32,
        /// s.
        seconds: f32,
    },
    /// Points in time, streamed with their speeds; the axis goes to the first one beforehand.
    Points(Vec<Waypoint>),
}

impl Profile {
    /// Length, s.
    pub fn seconds(&self) -> f64 {
        match self {
            Profile::Sine { seconds, .. } | Profile::Step { seconds, .. } => f64::from(*seconds),
            Profile::Points(points) => match (points.first(), points.last()) {
                (Some(first), Some(last)) => last.time_s - first.time_s,
                _ => 0.0,
            },
        }
    }
}
