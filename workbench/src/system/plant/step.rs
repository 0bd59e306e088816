//! What one step of the plant hands from the rotor to a second body, the sensor and back.

use super::state::State;
use servo::axis::Bridge;

/// The drive during one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Driven {
    /// Voltage behind sag and brushes, V, or torque input; `None`: the brushes block the current.
    pub net: Option<f64>,
    pub bridge: Bridge,
    pub h: f64,
}

/// External torques on the two sides of the gear, and the friction level in either direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loads {
    pub motor: f64,
    pub load: f64,
    pub friction_pos: f64,
    pub friction_neg: f64,
}

/// What the end of a step needs of its start. (A copy of the whole state would wait for its own last write.)
#[derive(Clone, Copy, Debug)]
pub(super) struct Before {
    pub theta: f64,
    pub omega: f64,
    pub theta_load: f64,
    pub omega_load: f64,
    pub lagged: f64,
}

impl Before {
    #[inline]
    pub fn of(state: &State) -> Self {
        let State { theta, omega, theta_load, omega_load, lagged, .. } = *state;
        Self { theta, omega, theta_load, omega_load, lagged }
    }
}

/// Dry friction as a proximal step: it takes speed away, at most all of it.
#[inline]
pub(super) fn slowed(free: f64, mobility: f64, loads: &Loads) -> f64 {
    if free > 0.0 {
        (free - mobility * loads.friction_pos).max(0.0)
    } else {
        (free + mobility * loads.friction_neg).min(0.0)
    }
}

/// The same from a speed that changes its sign on the way: up to there friction acts against that speed; only for the rest of
/// the step, if the torque overcomes it, the shaft goes on from standstill. `pushed`: what the torque alone adds to the speed.
#[inline]
pub(super) fn slowed_from(omega: f64, free: f64, pushed: f64, mobility: f64, loads: &Loads) -> f64 {
    let against =
        if omega > 0.0 { free - mobility * loads.friction_pos } else { free + mobility * loads.friction_neg };
    let frictionless = loads.friction_pos + loads.friction_neg <= 0.0;
    if omega == 0.0 || frictionless {
        return slowed(free, mobility, loads);
    }
    if against * omega >= 0.0 {
        return against;
    }
    let left = -against / (omega - against);
    slowed(left * pushed, left * mobility, loads)
}
