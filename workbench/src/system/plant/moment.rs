//! Terms without a name within a step: what the motion is doing, the torque of the terms, and what they do to the reading.

use super::physics::{Drive, Physics};
use super::state::State;
use super::step::{Before, Driven};
use super::unnamed::{Acting, Moment};
use super::winding::Coefficients;
use servo::axis::Bridge;

/// Where the shaft is known to be at start and end of a step.
type Places = Option<(f64, f64)>;

/// Torque of the terms while the shaft has the speed `omega` in the middle of the step.
pub(super) fn torque(
    p: &Physics,
    c: &Coefficients,
    state: &State,
    omega: f64,
    driven: &Driven,
    places: Places,
) -> f64 {
    let moment = moment(p, c, state, omega, driven, places);
    let per_input = p.torque_per_input();
    let unit = |acts: Acting| match acts {
        Acting::Torque => 1.0,
        Acting::Input => per_input,
        Acting::Reading => 0.0,
    };
    p.unnamed.iter().map(|term| unit(term.acts) * term.at(&moment)).sum()
}

/// What the motion is doing in the middle of a step.
fn moment(
    p: &Physics,
    c: &Coefficients,
    state: &State,
    omega: f64,
    driven: &Driven,
    places: Places,
) -> Moment {
    let half = 0.5 * driven.h;
    let (from, to) = places.unwrap_or((state.theta, state.theta + driven.h * state.omega));
    let (travel, since_s) = state.reversal.since(state.time_s, state.theta);
    Moment {
        time_s: state.time_s + half,
        theta: 0.5 * (from + to),
        omega,
        acceleration: (omega - state.omega) / half,
        current: current(p, c, state, omega, driven),
        input: driven.net.unwrap_or(0.0),
        gear_ratio: p.gear_ratio,
        travel,
        since_s,
    }
}

/// Mean current of a step at a speed.
fn current(p: &Physics, c: &Coefficients, state: &State, omega: f64, driven: &Driven) -> f64 {
    match (driven.bridge, p.drive, driven.net) {
        (Bridge::Open, ..) | (_, _, None) => 0.0,
        (_, Drive::Torque, Some(held)) => held,
        (_, Drive::Voltage, Some(net)) => {
            let settled = (net - p.ke * omega) * c.conductance;
            (settled + (state.current - settled) * c.mean).clamp(-p.current_limit, p.current_limit)
        }
    }
}

/// Follows the reversals after a step, and distorts the reading at its end and the integral of the reading over it.
pub(super) fn remember(
    p: &Physics,
    c: &Coefficients,
    state: &mut State,
    before: &Before,
    driven: &Driven,
    places: Places,
) {
    if p.unnamed.iter().any(|term| !term.moves()) {
        let (from, to) = places.unwrap_or((before.theta, state.theta));
        let middle = Moment { theta: 0.5 * (from + to), ..moment(p, c, state, state.omega, driven, places) };
        let end = Moment { theta: to, ..middle };
        let way = p.sensor_scale * (state.theta - before.theta);
        for term in p.unnamed.iter().filter(|term| !term.moves()) {
            state.reading += term.at(&end) * p.sensor_scale * state.omega;
            state.reading_integral += term.at(&middle) * way;
        }
    }
    state.reversal.follow(state.time_s, state.theta, state.omega, p.unnamed[0].standstill);
}
