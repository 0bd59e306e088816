//! The plant: a motor (or an inertia) with any of the library's effects.
//!
//! [`Motor`] is the incremental form: one command, one step, one answer, as behind the firmware image. The whole-log
//! form simulates a log; both advance the same [`dynamics::Dynamics`].

pub mod dynamics;
pub mod effort;
mod external;
pub mod features;
mod formulas;
pub mod input;
pub mod laws;
pub mod physics;
mod sensor;
pub mod simd;
pub mod state;
mod step;
mod step_size;
mod two_bodies;
pub mod unnamed;
mod unnamed_step;
mod winding;

use dynamics::Dynamics;
use features::Features;
use physics::Physics;
use servo::axis::Bridge;
use state::State;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// The longest inner step as a part of the mechanical time constant. The trapezoid's error falls with its square.
/// Chosen by judgement; not studied.
const LONGEST_STEP: f64 = 1.0 / 100.0;

/// A motor that is driven step by step.
#[derive(Clone, Debug)]
pub struct Motor {
    plant: Physics,
    state: State,
    counts_per_rev: f64,
    /// Pieces of the command that are not yet applied or still partly delayed: (end time, command).
    commands: VecDeque<(f64, f64)>,
    lagged: f64,
}

/// What the sensors of a [`Motor`] say at the end of a step, free of noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Encoder count, ×4, wrapping.
    pub count: i32,
    /// Position as the encoder's side sees it, rad.
    pub theta_rad: f64,
    /// Speed as the sensor reports it, rad/s.
    pub omega_rad_s: f64,
    /// Winding current, mean over the step, A.
    pub current_a: f64,
    /// Supply voltage at the end of the step, V.
    pub supply_v: f64,
}

impl Motor {
    /// At rest at position 0. `counts_per_rev` after ×4 decoding.
    pub fn new(plant: Physics, counts_per_rev: f64) -> Self {
        let state = State::moving(&plant, 0.0, 0.0);
        Self { plant, state, counts_per_rev, commands: VecDeque::new(), lagged: 0.0 }
    }

    /// Places the shaft, for a start at another angle.
    pub fn at(mut self, theta_rad: f64) -> Self {
        self.state = State::moving(&self.plant, theta_rad, 0.0);
        self
    }

    /// The plant's parameters.
    pub fn plant(&self) -> &Physics {
        &self.plant
    }

    /// The true state: for tests and reports, never for the firmware.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// A duty −1 … 1 of the motor's own supply for `dt` seconds.
    pub fn step_duty(&mut self, duty: f64, bridge: Bridge, dt: f64) -> Answer {
        self.step(duty * self.plant.supply_v, bridge, dt)
    }

    /// A terminal voltage (or torque input) for `dt` seconds. `bridge`: 0 open, 1 driven, 2 shorted.
    pub fn step(&mut self, command: f64, bridge: Bridge, dt: f64) -> Answer {
        let applied = self.behind_delay(command, dt);
        let applied = self.behind_lag(applied, dt);
        let features = Features::of(&self.plant);
        let applied = self.plant.applied_to(features.chain(), applied);
        let pieces = (dt / (LONGEST_STEP * self.plant.time_constant_s())).ceil().clamp(1.0, 100.0) as usize;
        let mut dynamics = Dynamics::new(&self.plant, features);
        let mut charge = 0.0;
        for _ in 0..pieces {
            advanced(&mut dynamics, &mut self.state, applied, bridge, dt / pieces as f64);
            charge += self.state.mean_current;
        }
        self.answer(charge / pieces as f64)
    }

    fn answer(&self, current_a: f64) -> Answer {
        let theta_rad = self.state.reading_integral;
        Answer {
            count: (theta_rad / TAU * self.counts_per_rev).floor() as i64 as i32,
            theta_rad,
            omega_rad_s: self.state.reading,
            current_a,
            supply_v: self.state.supply_v,
        }
    }

    /// Mean of the delayed command over the step.
    fn behind_delay(&mut self, command: f64, dt: f64) -> f64 {
        if self.plant.delay_s <= 0.0 {
            return command;
        }
        let now = self.state.time_s;
        self.commands.push_back((now + dt, command));
        let (from, to) = (now - self.plant.delay_s, now + dt - self.plant.delay_s);
        while self.commands.front().is_some_and(|piece| piece.0 <= from) {
            self.commands.pop_front();
        }
        let mut start = from.max(0.0);
        let mut area = 0.0;
        for (end, value) in &self.commands {
            let end = end.min(to);
            area += value * (end - start).max(0.0);
            start = start.max(end);
        }
        area / dt
    }

    /// Mean of the lagged command over the step.
    fn behind_lag(&mut self, command: f64, dt: f64) -> f64 {
        let lag = self.plant.lag_s;
        if lag <= 0.0 {
            return command;
        }
        let rest = self.lagged - command;
        let decay = (-dt / lag).exp();
        self.lagged = command + rest * decay;
        command + rest * (1.0 - decay) * lag / dt
    }
}

/// A step of one plant, as a function of its own: a step is long, and the simulation of records holds another copy.
#[inline(never)]
fn advanced(dynamics: &mut Dynamics, state: &mut State, applied: f64, bridge: Bridge, h: f64) {
    dynamics.advance(state, applied, bridge, h, None);
}
