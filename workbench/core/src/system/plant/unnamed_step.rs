//! Terms without a name within a step: what the motion is doing, the torque of the terms, and what they do to the reading.
//!
//! A term is a table of one plant: plants with terms are advanced one by one, never in lock-step.

use super::physics::{Drive, Physics};
use super::simd::Lanes;
use super::state::State;
use super::step::{Before, Driven, Places};
use super::unnamed::{Acting, Moment};
use super::winding::Coefficients;
use servo::axis::Bridge;

/// A plant with terms, and what drives it over a step.
pub(super) struct Step<'a, F: Lanes> {
    pub plant: &'a Physics<F>,
    pub coefficients: &'a Coefficients<F>,
    pub driven: &'a Driven<F>,
    pub places: Places<F>,
}

impl<F: Lanes> Step<'_, F> {
    /// Torque of the terms while the shaft has the speed `omega` in the middle of the step.
    pub fn torque(&self, state: &State<F>, omega: F) -> F {
        let p = self.plant;
        let moment = self.moment(state, omega);
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
    fn moment(&self, state: &State<F>, omega: F) -> Moment {
        let (p, driven) = (self.plant, self.driven);
        let half = 0.5 * driven.h;
        let (from, to) = self.places.unwrap_or((state.theta, state.theta + state.omega * driven.h));
        let (travel, since_s) = state.reversal.since(state.time_s, state.theta.lane(0));
        let blocked = F::select(driven.blocked, omega.like(0.0), driven.net);
        Moment {
            time_s: state.time_s + half,
            theta: ((from + to) * 0.5).lane(0),
            omega: omega.lane(0),
            acceleration: ((omega - state.omega) * (1.0 / half)).lane(0),
            current: self.current(state, omega).lane(0),
            input: blocked.lane(0),
            gear_ratio: p.gear_ratio.lane(0),
            travel,
            since_s,
        }
    }

    /// Mean current of a step at a speed.
    fn current(&self, state: &State<F>, omega: F) -> F {
        let (p, c, driven) = (self.plant, self.coefficients, self.driven);
        let none = omega.like(0.0);
        match (driven.bridge, p.drive) {
            (Bridge::Open, _) => none,
            (_, Drive::Torque) => driven.net,
            (_, Drive::Voltage) => {
                let settled = (driven.net - p.ke * omega) * c.conductance;
                let mean = (settled + (state.current - settled) * c.mean).within(p.current_limit);
                F::select(driven.blocked, none, mean)
            }
        }
    }

    /// Follows the reversals after a step, and distorts the reading at its end and the integral of the reading over it.
    pub fn remember(&self, state: &mut State<F>, before: &Before<F>) {
        let p = self.plant;
        if p.unnamed.iter().any(|term| !term.moves()) {
            let (from, to) = self.places.unwrap_or((before.theta, state.theta));
            let theta = ((from + to) * 0.5).lane(0);
            let middle = Moment { theta, ..self.moment(state, state.omega) };
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
}
