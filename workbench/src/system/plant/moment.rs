//! Terms without a name within a step: what the motion is doing, the torque of the terms, and what they do to the reading.
//!
//! A term is a table of one plant: plants with terms are advanced one by one, never in lock-step.

use super::lanes::Lanes;
use super::physics::{Drive, Physics};
use super::state::State;
use super::step::{Before, Driven, Places};
use super::unnamed::{Acting, Moment};
use super::winding::Coefficients;
use servo::axis::Bridge;

/// Torque of the terms while the shaft has the speed `omega` in the middle of the step.
pub(super) fn torque<F: Lanes>(
    p: &Physics<F>,
    c: &Coefficients<F>,
    state: &State<F>,
    omega: F,
    driven: &Driven<F>,
    places: Places<F>,
) -> F {
    let moment = moment(p, c, state, omega, driven, places);
    let per_input = match p.drive {
        Drive::Voltage => p.kt / p.resistance,
        Drive::Torque => p.force_gain,
    };
    let unit = |acts: Acting| match acts {
        Acting::Torque => 1.0,
        Acting::Input => per_input.lane(0),
        Acting::Reading => 0.0,
    };
    omega.like(p.unnamed.iter().map(|term| unit(term.acts) * term.at(&moment)).sum())
}

/// What the motion is doing in the middle of a step.
fn moment<F: Lanes>(
    p: &Physics<F>,
    c: &Coefficients<F>,
    state: &State<F>,
    omega: F,
    driven: &Driven<F>,
    places: Places<F>,
) -> Moment {
    let half = 0.5 * driven.h;
    let (from, to) = places.unwrap_or((state.theta, state.theta + state.omega * driven.h));
    let (travel, since_s) = state.reversal.since(state.time_s, state.theta.lane(0));
    let blocked = F::select(driven.blocked, omega.like(0.0), driven.net);
    Moment {
        time_s: state.time_s + half,
        theta: ((from + to) * 0.5).lane(0),
        omega: omega.lane(0),
        acceleration: ((omega - state.omega) * (1.0 / half)).lane(0),
        current: current(p, c, state, omega, driven).lane(0),
        input: blocked.lane(0),
        gear_ratio: p.gear_ratio.lane(0),
        travel,
        since_s,
    }
}

/// Mean current of a step at a speed.
fn current<F: Lanes>(p: &Physics<F>, c: &Coefficients<F>, at: &State<F>, omega: F, driven: &Driven<F>) -> F {
    let none = omega.like(0.0);
    match (driven.bridge, p.drive) {
        (Bridge::Open, _) => none,
        (_, Drive::Torque) => driven.net,
        (_, Drive::Voltage) => {
            let settled = (driven.net - p.ke * omega) * c.conductance;
            let mean = (settled + (at.current - settled) * c.mean).within(p.current_limit);
            F::select(driven.blocked, none, mean)
        }
    }
}

/// Follows the reversals after a step, and distorts the reading at its end and the integral of the reading over it.
pub(super) fn remember<F: Lanes>(
    p: &Physics<F>,
    c: &Coefficients<F>,
    state: &mut State<F>,
    before: &Before<F>,
    driven: &Driven<F>,
    places: Places<F>,
) {
    if p.unnamed.iter().any(|term| !term.moves()) {
        let (from, to) = places.unwrap_or((before.theta, state.theta));
        let theta = ((from + to) * 0.5).lane(0);
        let middle = Moment { theta, ..moment(p, c, state, state.omega, driven, places) };
        let end = Moment { theta: to.lane(0), ..middle };
        let way = p.sensor_scale * (state.theta - before.theta);
        for term in p.unnamed.iter().filter(|term| !term.moves()) {
            state.reading = state.reading + p.sensor_scale * state.omega * term.at(&end);
            state.reading_integral = state.reading_integral + way * term.at(&middle);
        }
    }
    let standstill = p.unnamed[0].standstill;
    state.reversal.follow(state.time_s, state.theta.lane(0), state.omega.lane(0), standstill);
}
