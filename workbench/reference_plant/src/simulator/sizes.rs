//! What the equations of a motor need: which states move, on which the rates depend, how large each becomes, and how often
//! its noise changes.

use crate::motor::{Motor, Train};
use crate::rosenbrock::{N, State};
use crate::state::*;

/// Held noise changes this often per correlation time: its spectrum is right to within a per cent up to the corner.
const HOLDS_PER_CORRELATION: f64 = 8.0;

pub(super) fn noise_hold(motor: &Motor) -> f64 {
    let torque = if motor.load.noise_nm > 0.0 { motor.load.noise_s } else { f64::INFINITY };
    let ripple = if motor.drive.ripple > 0.0 { motor.drive.ripple_s } else { f64::INFINITY };
    torque.min(ripple) / HOLDS_PER_CORRELATION
}

pub(super) fn moving_states(motor: &Motor) -> Vec<usize> {
    let tacho = motor.tacho.as_ref();
    let present = [
        (CURRENT, true),
        (SPEED, true),
        (ANGLE, true),
        (LOAD_SPEED, motor.has_two_bodies()),
        (LOAD_ANGLE, motor.has_two_bodies()),
        (BRISTLE, motor.friction.bristle.is_some()),
        (HEAT, motor.thermal.is_some()),
        (BUS, motor.drive.bus_farad > 0.0),
        (LAG, motor.drive.lag_s > 0.0),
        (SENSED, tacho.is_some_and(|tacho| tacho.lag_s > 0.0)),
        (SENSED_ANGLE, tacho.is_some()),
    ];
    present.iter().filter(|state| state.1).map(|state| state.0).collect()
}

/// Columns of the Jacobian that are not zero.
pub(super) fn needed_columns(motor: &Motor) -> [bool; N] {
    let load = &motor.load;
    let by_angle = load.mgl_nm != 0.0
        || load.cogging_nm != 0.0
        || load.law.is_some()
        || load.oddity.is_some()
        || motor.friction.depends_on_angle()
        || motor.load_friction.depends_on_angle()
        || motor.has_two_bodies();
    let mut needed = [true; N];
    needed[ANGLE] = by_angle;
    needed[LOAD_ANGLE] = by_angle;
    needed[SENSED_ANGLE] = false;
    needed
}

/// Full scale of each state, from the supply.
pub(super) fn natural_sizes(motor: &Motor) -> State {
    let volts = motor.drive.supply_v;
    let speed = (volts * motor.gain()).max(1e-9);
    let angle = speed * motor.time_constant();
    let current = volts / motor.resistance_ohm;
    let mut size = [1.0; N];
    size[CURRENT] = current;
    size[SPEED] = speed;
    size[ANGLE] = angle;
    size[LOAD_SPEED] = speed;
    size[LOAD_ANGLE] = angle;
    size[BRISTLE] = motor.friction.bristle.map_or(1.0, |bristle| bristle.deflection_rad);
    size[HEAT] = volts * current;
    size[BUS] = volts;
    size[LAG] = volts;
    size[SENSED] = speed;
    size[SENSED_ANGLE] = angle;
    if let Train::Play { gap_rad, .. } = motor.train {
        size[ANGLE] = angle.min(100.0 * gap_rad);
        size[LOAD_ANGLE] = size[ANGLE];
    }
    size
}
