//! Drives the motor through time: breaks of the inputs, steps under error control, switchings located to rounding.

mod sizes;
mod steps;

use crate::drive::{Command, Decay};
use crate::modes::{Held, Modes};
use crate::motor::{Motor, Oddity};
use crate::noise::GaussMarkov;
use crate::rosenbrock::{N, State, System};
use crate::state::*;
use servo::axis::Bridge;
use sizes::{moving_states, natural_sizes, needed_columns, noise_hold};
use std::collections::VecDeque;

/// The state of the world at the end of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Rotor angle, rad.
    pub theta: f64,
    /// Rotor speed, rad/s.
    pub omega: f64,
    /// Winding current, mean over the tick, A.
    pub current: f64,
    /// Supply voltage, V.
    pub supply: f64,
}

/// A motor in time.
#[derive(Clone, Debug)]
pub struct Simulator {
    motor: Motor,
    tolerance: f64,
    scale: State,
    moving: Vec<usize>,
    needed: [bool; N],
    time: f64,
    state: State,
    modes: Modes,
    held: Held,
    next_step: f64,
    pending: VecDeque<(f64, Command)>,
    next_bridge: Bridge,
    load_steps: VecDeque<(f64, f64)>,
    torque_noise: GaussMarkov,
    ripple: GaussMarkov,
    noise_hold_s: f64,
    next_noise: f64,
    period_start: f64,
    next_pwm_edge: f64,
    charge: f64,
    steps: u64,
    switchings: u64,
    overlooked: u64,
}

impl Simulator {
    /// Starts at rest. `tolerance` is the error of one step relative to full scale: 1e-6 for suites in lock-step with
    /// sensors, 1e-9 for references. `seed` rules torque noise and supply ripple.
    pub fn new(motor: Motor, tolerance: f64, seed: u64) -> Self {
        let noise_hold_s = noise_hold(&motor);
        let ripple_v = motor.drive.ripple * motor.drive.supply_v;
        let held = Held {
            command: Command::Volts(0.0),
            bridge: Bridge::Open,
            full_on: None,
            load_nm: motor.load.constant_nm,
            noise_nm: 0.0,
            ripple_v: 0.0,
        };
        let mut state = [0.0; N];
        state[BUS] = motor.drive.supply_v;
        let mut simulator = Self {
            tolerance,
            scale: natural_sizes(&motor),
            moving: moving_states(&motor),
            needed: needed_columns(&motor),
            time: 0.0,
            modes: Modes::at_rest(&motor),
            held,
            state,
            next_step: 0.1 * motor.time_constant(),
            pending: VecDeque::new(),
            next_bridge: Bridge::Open,
            load_steps: motor.load.steps.iter().copied().collect(),
            torque_noise: GaussMarkov::sampled(
                motor.load.noise_nm,
                motor.load.noise_s.max(1e-9),
                noise_hold_s,
                seed,
            ),
            ripple: GaussMarkov::sampled(ripple_v, motor.drive.ripple_s, noise_hold_s, seed ^ 0x5eed_0001),
            noise_hold_s,
            next_noise: 0.0,
            period_start: 0.0,
            next_pwm_edge: f64::INFINITY,
            charge: 0.0,
            steps: 0,
            switchings: 0,
            overlooked: 0,
            motor,
        };
        simulator.settle();
        simulator
    }

    /// Starts in motion: speeds of rotor and load in rad/s, angle in rad.
    pub fn moving_at(mut self, omega: f64, theta: f64) -> Self {
        self.state[SPEED] = omega;
        self.state[ANGLE] = theta;
        if self.motor.has_two_bodies() {
            self.state[LOAD_SPEED] = omega;
            self.state[LOAD_ANGLE] = theta;
        }
        let direction =
            if omega >= 0.0 { super::modes::Motion::Forward } else { super::modes::Motion::Backward };
        self.modes.motion = [direction; 2];
        self.settle();
        self
    }

    /// Comes out of a dead stop, where the simulation stood still: no speed, this winding current.
    pub fn released(&mut self, current: f64) {
        self.state[SPEED] = 0.0;
        self.state[LOAD_SPEED] = 0.0;
        self.state[CURRENT] = current;
        self.modes = Modes::at_rest(&self.motor);
        self.settle();
    }

    /// The motor.
    pub fn motor(&self) -> &Motor {
        &self.motor
    }

    /// Time, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The state vector, by [`super::state`].
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Momentary supply voltage, V.
    pub fn supply(&self) -> f64 {
        self.motor.drive.supply(self.held.live_command(), self.held.ripple_v, &self.state)
    }

    /// Steps tried so far, without those that located switchings.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Switchings so far.
    pub fn switchings(&self) -> u64 {
        self.switchings
    }

    /// Switchings that were passed over because a cascade at one instant did not end. 0 in a healthy run.
    pub fn overlooked(&self) -> u64 {
        self.overlooked
    }

    /// One control tick: applies a duty (−1 … 1, of the motor's own supply) for `dt` seconds.
    pub fn step(&mut self, duty: f64, bridge: Bridge, dt: f64) -> Reading {
        self.run(Command::Duty(duty), bridge, dt)
    }

    /// Applies a command for `dt` seconds.
    pub fn run(&mut self, command: Command, bridge: Bridge, dt: f64) -> Reading {
        self.command(command, bridge);
        self.charge = 0.0;
        self.advance(self.time + dt);
        Reading {
            theta: self.state[ANGLE],
            omega: self.state[SPEED],
            current: self.charge / dt,
            supply: self.supply(),
        }
    }

    /// Gives a command, which takes effect after the drive's delay, and opens or closes the bridge, which does so at
    /// once: a log's bridge column tells the state of the bridge.
    pub fn command(&mut self, command: Command, bridge: Bridge) {
        let due = self.time + self.motor.drive.delay_s;
        self.pending.push_back((due, command));
        self.next_bridge = bridge;
        self.take_what_is_due();
    }

    /// Simulates up to `end`, s.
    pub fn advance(&mut self, end: f64) {
        while self.time < end {
            self.take_what_is_due();
            let stop = self.next_break().min(end);
            self.integrate(stop);
            self.time = stop;
        }
        self.take_what_is_due();
    }

    fn next_break(&self) -> f64 {
        let command = self.pending.front().map_or(f64::INFINITY, |pending| pending.0);
        let load = self.load_steps.front().map_or(f64::INFINITY, |step| step.0);
        command.min(load).min(self.next_noise).min(self.next_pwm_edge)
    }

    fn take_what_is_due(&mut self) {
        let before = (self.held.command, self.held.bridge);
        let mut changed = false;
        while self.pending.front().is_some_and(|pending| pending.0 <= self.time) {
            if let Some((_, command)) = self.pending.pop_front() {
                self.held.command = command;
            }
        }
        self.held.bridge = self.next_bridge;
        changed |= before != (self.held.command, self.held.bridge);
        while self.load_steps.front().is_some_and(|step| step.0 <= self.time) {
            self.held.load_nm = self.load_steps.pop_front().map_or(0.0, |step| step.1);
            changed = true;
        }
        if self.next_noise <= self.time {
            self.held.noise_nm = self.torque_noise.next_value();
            self.held.ripple_v = self.ripple.next_value();
            self.next_noise += self.noise_hold_s;
            changed = true;
        }
        changed |= self.take_pwm_edge(changed);
        if changed {
            self.settle();
        }
    }

    /// Fast decay: on-time at the start of each PWM period, diodes for the rest.
    fn take_pwm_edge(&mut self, commanded: bool) -> bool {
        let Decay::Fast { pwm_hz } = self.motor.drive.decay else {
            return false;
        };
        if self.held.bridge != Bridge::Driven {
            self.held.full_on = None;
            self.next_pwm_edge = f64::INFINITY;
            return false;
        }
        if self.next_pwm_edge == f64::INFINITY {
            self.next_pwm_edge = self.time;
        }
        if self.next_pwm_edge > self.time {
            return commanded;
        }
        let period = 1.0 / pwm_hz;
        let duty = self.motor.drive.duty(self.held.command).clamp(-1.0, 1.0);
        let ended = self.held.full_on.is_some() && duty.abs() < 1.0;
        if ended || duty == 0.0 {
            self.held.full_on = None;
            self.next_pwm_edge = self.period_start + period;
            if self.next_pwm_edge <= self.time {
                self.period_start = self.time;
                self.next_pwm_edge = self.time + period;
            }
        } else {
            self.period_start = self.time;
            self.held.full_on = Some(duty.signum());
            self.next_pwm_edge = self.time + duty.abs() * period;
        }
        true
    }

    fn settle(&mut self) {
        self.modes.settle(&self.motor, &self.held, self.time, &mut self.state);
    }
}

impl System for Simulator {
    fn moving(&self) -> &[usize] {
        &self.moving
    }

    fn rates(&self, t: f64, y: &State) -> State {
        self.motor.rates(&self.held, &self.modes, t, y)
    }

    fn depends_on(&self, index: usize) -> bool {
        self.needed[index]
    }

    fn depends_on_time(&self) -> bool {
        let odd = matches!(
            self.motor.load.oddity,
            Some(Oddity::ViscosityDrift { .. } | Oddity::SweepingLoad { .. })
        );
        self.motor.load.periodic_nm != 0.0 || odd
    }

    fn scale(&self) -> &State {
        &self.scale
    }
}
