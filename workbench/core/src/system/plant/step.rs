//! What one step of the plant hands from the rotor to a second body, the sensor and back.

use super::simd::{Lanes, Mask};
use super::state::State;
use servo::axis::Bridge;

/// Where the shaft is known to be at start and end of a step.
pub(super) type Places<F> = Option<(F, F)>;

/// The drive during one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Driven<F: Lanes> {
    /// Voltage behind sag and brushes, V, or torque input.
    pub net: F,
    /// Where the brushes block the current; only looked at where there are brushes.
    pub blocked: F::Mask,
    pub bridge: Bridge,
    pub h: f64,
}

/// External torques on the two sides of the gear, and the friction level in either direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loads<F = f64> {
    pub motor: F,
    pub load: F,
    pub friction_pos: F,
    pub friction_neg: F,
}

/// What the end of a step needs of its start. (A copy of the whole state would wait for its own last write.)
#[derive(Clone, Copy, Debug)]
pub(super) struct Before<F = f64> {
    pub theta: F,
    pub omega: F,
    pub theta_load: F,
    pub omega_load: F,
    pub lagged: F,
}

impl<F: Lanes> Before<F> {
    #[inline(always)]
    pub fn of(state: &State<F>) -> Self {
        let State { theta, omega, theta_load, omega_load, lagged, .. } = *state;
        Self { theta, omega, theta_load, omega_load, lagged }
    }
}

/// Dry friction as a proximal step: it takes speed away, at most all of it.
#[inline(always)]
pub(super) fn slowed<F: Lanes>(free: F, mobility: F, loads: &Loads<F>) -> F {
    let none = free.like(0.0);
    let forward = (free - mobility * loads.friction_pos).max(none);
    let backward = (free + mobility * loads.friction_neg).min(none);
    F::select(free.gt(none), forward, backward)
}

/// The same from a speed that changes its sign on the way: up to there friction acts against that speed; only for the rest of
/// the step, if the torque overcomes it, the shaft goes on from standstill. `pushed`: what the torque alone adds to the speed.
#[inline(always)]
pub(super) fn slowed_from<F: Lanes>(omega: F, free: F, pushed: F, mobility: F, loads: &Loads<F>) -> F {
    let none = omega.like(0.0);
    let forward = omega.gt(none);
    let braked =
        F::select(forward, free - mobility * loads.friction_pos, free + mobility * loads.friction_neg);
    let frictionless = (loads.friction_pos + loads.friction_neg).le(none);
    let simple = !(forward | omega.lt(none)) | frictionless;
    let keeps = (braked * omega).ge(none) & !simple;
    if keeps.all() {
        return braked;
    }
    let at_once = slowed(free, mobility, loads);
    if simple.all() {
        return at_once;
    }
    let left = -braked / (omega - braked);
    let turned = slowed(left * pushed, left * mobility, loads);
    F::select(simple, at_once, F::select(keeps, braked, turned))
}
