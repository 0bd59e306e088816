//! Drives the motor through time: breaks of the inputs, steps under error control, switchings located to rounding.

use super::drive::{Command, Decay};
use super::modes::{GUARDS, Held, Modes};
use super::motor::{Motor, Oddity, Train};
use super::noise::GaussMarkov;
use super::rosenbrock::{self, N, State, Step, System};
use super::state::*;
use servo::axis::Bridge;
use std::collections::VecDeque;

/// Held noise changes this often per correlation time: its spectrum is right to within a per cent up to the corner.
const HOLDS_PER_CORRELATION: f64 = 8.0;
/// Switchings at one instant before one is overlooked for a moment (see [`Simulator::overlooked`]).
const MOST_SWITCHINGS_AT_ONCE: u32 = 40;

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
        let direction = if omega >= 0.0 {
            super::modes::Motion::Forward
        } else {
            super::modes::Motion::Backward
        };
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
        self.motor
            .drive
            .supply(self.held.live_command(), self.held.ripple_v, &self.state)
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
        self.modes
            .settle(&self.motor, &self.held, self.time, &mut self.state);
    }

    /// Integrates to `stop` with constant inputs.
    fn integrate(&mut self, stop: f64) {
        let mut at_once = 0;
        // Below this length a rest is rounding.
        let least = 1e-14 * stop.abs().max(1e-3);
        while stop - self.time > least {
            let rest = stop - self.time;
            // Two equal steps rather than a long one and a sliver.
            let h = if self.next_step >= rest {
                rest
            } else {
                self.next_step.min(0.5 * rest).max(least)
            };
            let step = rosenbrock::step(self, self.time, &self.state, h);
            self.steps += 1;
            let ratio = step.error / self.tolerance;
            let factor = if ratio > 0.0 {
                (0.9 * ratio.powf(-0.25)).clamp(0.1, 5.0)
            } else {
                5.0
            };
            if ratio > 1.0 && h > 10.0 * least {
                self.next_step = h * factor.min(0.9);
                continue;
            }
            if h == self.next_step || factor < 1.0 {
                self.next_step = h * factor;
            } else {
                self.next_step = self.next_step.max(h * factor);
            }
            at_once = if at_once > MOST_SWITCHINGS_AT_ONCE {
                self.overlooked += 1;
                self.accept(&step);
                0
            } else {
                self.accept_up_to_switching(step, at_once)
            };
        }
    }

    /// Accepts the step, or the part of it before the first switching. Returns the number of switchings in a row that
    /// took no time.
    fn accept_up_to_switching(&mut self, step: Step, at_once: u32) -> u32 {
        let start = self.guards(self.time, &self.state);
        let end = self.guards(self.time + step.h, &step.end);
        if let Some(which) = (0..GUARDS).find(|&g| start[g] <= 0.0 && end[g] < 0.0) {
            self.switch(which);
            return at_once + 1;
        }
        let crossed = |guards: &[f64; GUARDS]| (0..GUARDS).any(|g| start[g] > 0.0 && guards[g] < 0.0);
        let middle = self.guards(self.time + 0.5 * step.h, &step.at(0.5));
        let bracket = if crossed(&middle) {
            rosenbrock::step(self, self.time, &self.state, 0.5 * step.h)
        } else {
            step
        };
        let end = self.guards(self.time + bracket.h, &bracket.end);
        if !crossed(&end) {
            self.accept(&bracket);
            return 0;
        }
        let (which, step) = self.locate(bracket, &start);
        self.accept(&step);
        self.switch(which);
        0
    }

    /// Shortens the step to the first switching: false position with halved ends (the Illinois rule) on real steps, so that
    /// the switching is as exact as the solution. Ends just beyond the switching.
    fn locate(&self, mut beyond: Step, start: &[f64; GUARDS]) -> (usize, Step) {
        let worst = |guards: &[f64; GUARDS]| {
            let active = |g: usize| start[g] > 0.0 && start[g].is_finite();
            let relative = |g: usize| {
                if active(g) {
                    guards[g] / start[g]
                } else {
                    f64::INFINITY
                }
            };
            (0..GUARDS)
                .map(|g| (g, relative(g)))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or((0, 0.0))
        };
        let (mut which, mut high) = worst(&self.guards(self.time + beyond.h, &beyond.end));
        let (mut before, mut low) = (0.0, 1.0);
        let (mut side, mut value_beyond) = (0, high);
        for _ in 0..80 {
            let width = beyond.h - before;
            if width <= 4.0 * f64::EPSILON * (self.time.abs() + beyond.h) || value_beyond > -1e-14 {
                break;
            }
            let guess =
                (before + width * low / (low - high)).clamp(before + 0.001 * width, beyond.h - 0.001 * width);
            let step = rosenbrock::step(self, self.time, &self.state, guess);
            let (guard, value) = worst(&self.guards(self.time + guess, &step.end));
            if value < 0.0 {
                (beyond, high, value_beyond, which) = (step, value, value, guard);
                low *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                (before, low) = (guess, value.min(1.0));
                high *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
            }
        }
        (which, beyond)
    }

    fn guards(&self, t: f64, y: &State) -> [f64; GUARDS] {
        self.modes.guards(&self.motor, &self.held, t, y)
    }

    fn switch(&mut self, which: usize) {
        self.switchings += 1;
        self.modes
            .switch(which, &self.motor, &self.held, self.time, &mut self.state);
    }

    fn accept(&mut self, step: &Step) {
        // Simpson's rule on the continuous extension.
        let middle = step.at(0.5)[CURRENT];
        self.charge += step.h / 6.0 * (self.state[CURRENT] + 4.0 * middle + step.end[CURRENT]);
        self.time += step.h;
        self.state = step.end;
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

fn noise_hold(motor: &Motor) -> f64 {
    let torque = if motor.load.noise_nm > 0.0 {
        motor.load.noise_s
    } else {
        f64::INFINITY
    };
    let ripple = if motor.drive.ripple > 0.0 {
        motor.drive.ripple_s
    } else {
        f64::INFINITY
    };
    torque.min(ripple) / HOLDS_PER_CORRELATION
}

fn moving_states(motor: &Motor) -> Vec<usize> {
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
    present
        .iter()
        .filter(|state| state.1)
        .map(|state| state.0)
        .collect()
}

/// Columns of the Jacobian that are not zero.
fn needed_columns(motor: &Motor) -> [bool; N] {
    let load = &motor.load;
    let by_angle = load.mgl_nm != 0.0
        || load.cogging_nm != 0.0
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
fn natural_sizes(motor: &Motor) -> State {
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
    size[BRISTLE] = motor
        .friction
        .bristle
        .map_or(1.0, |bristle| bristle.deflection_rad);
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
