//! One step of winding, friction and inertia.
//!
//! The winding is solved exactly for a constant mean back-EMF, so that a small L/R costs no small steps; speed and
//! back-EMF are coupled implicitly (trapezoid), so that no motor is too fast; friction acts as a proximal step
//! (Acary, Brogliato: Numerical Methods for Nonsmooth Dynamical Systems, 2008): true sticking without switching logic.

use super::moment;
use super::physics::{Acts, Drive, Motion, Physics};
use super::state::State;
use super::step::{Before, Driven, Loads, slowed_from};
use super::two_bodies;
use super::winding::{Coefficients, Shaft};
use servo::axis::Bridge;
use std::f64::consts::PI;

/// A contact that is over within such a part of a step is inelastic for every log.
const MOST_CONTACT_PIECES: f64 = 12.0;

/// Advances a [`State`]. Keeps the coefficients of the last step length.
#[derive(Clone, Debug)]
pub struct Dynamics<'a> {
    plant: &'a Physics,
    coefficients: Coefficients,
    present: Present,
}

/// Which kinds of effects are there at all: the others cost nothing.
#[derive(Clone, Copy, Debug)]
struct Present {
    two_bodies: bool,
    play: bool,
    varying_winding: bool,
    varying_friction: bool,
    sag: bool,
    unnamed: bool,
}

impl<'a> Dynamics<'a> {
    /// For a plant.
    pub fn new(plant: &'a Physics) -> Self {
        let two_bodies = plant.load_share > 0.0 && (plant.gap_rad > 0.0 || plant.stiffness.is_finite());
        let present = Present {
            two_bodies,
            play: plant.gap_rad > 0.0 && !two_bodies,
            varying_winding: plant.heat_rise_per_w > 0.0
                || plant.source_ohm > 0.0
                || plant.kt_knee_a.is_finite(),
            varying_friction: plant.breakaway_extra > 0.0
                || plant.friction_per_motor > 0.0
                || plant.friction_per_load > 0.0,
            sag: plant.source_ohm > 0.0,
            unnamed: !plant.unnamed.is_empty(),
        };
        Self { plant, coefficients: Coefficients::new(plant, plant.resistance, plant.kt, 1.0), present }
    }

    /// Advances by `h` seconds with a constant voltage (or torque input) behind the input chain. `position`: where
    /// the shaft is known to be at start and end of the step (measured), for torques that depend on it.
    #[inline]
    pub fn advance(
        &mut self,
        state: &mut State,
        applied: f64,
        bridge: Bridge,
        h: f64,
        position: Option<(f64, f64)>,
    ) {
        if !self.present.two_bodies {
            return self.step(state, applied, bridge, h, position);
        }
        let pieces = if self.plant.contact_rad_s.is_finite() {
            contact_pieces(h * self.plant.contact_rad_s)
        } else {
            resonance_pieces(h * self.plant.resonance_rad_s())
        };
        for piece in 0..pieces as usize {
            let part = |k: usize| position.map(|(from, to)| from + (to - from) * k as f64 / pieces);
            self.step(state, applied, bridge, h / pieces, part(piece).zip(part(piece + 1)));
        }
    }

    #[inline]
    fn step(
        &mut self,
        state: &mut State,
        applied: f64,
        bridge: Bridge,
        h: f64,
        position: Option<(f64, f64)>,
    ) {
        let before = Before::of(state);
        self.renew(state, applied, bridge, h);
        let driven = Driven { net: self.net_voltage(state, applied, bridge, h), bridge, h };
        let (omega, omega_load) = self.moved_under_loads(state, &driven, position);
        self.settle_current(state, &driven, omega);
        if self.present.sag {
            self.settle_supply(state, applied, h);
        }
        state.time_s += h;
        state.theta += 0.5 * h * (before.omega + omega);
        state.omega = omega;
        self.settle_load(state, &before, omega_load, h);
        self.plant.sense(state, &before, h);
        if self.present.unnamed {
            moment::remember(self.plant, &self.coefficients, state, &before, &driven, position);
        }
    }

    /// Makes sure that the coefficients are those of this step.
    #[inline]
    fn renew(&mut self, state: &State, applied: f64, bridge: Bridge, h: f64) {
        let p = self.plant;
        let (resistance, kt) = if self.present.varying_winding {
            (self.resistance(state, applied, h), self.weakened(state, applied, bridge))
        } else {
            (p.resistance, p.kt)
        };
        if self.coefficients.serve(resistance, kt, h) {
            return;
        }
        if self.coefficients.step_is(h) {
            self.coefficients.vary(p, resistance, kt);
        } else {
            self.coefficients = Coefficients::new(p, resistance, kt, h);
        }
    }

    /// The torque constant at the mean current of the step, as the last step's winding predicts it: with the current at the start,
    /// the torque would lag half a step behind.
    fn weakened(&self, state: &State, applied: f64, bridge: Bridge) -> f64 {
        let (p, c) = (self.plant, &self.coefficients);
        if p.kt_knee_a == f64::INFINITY {
            return p.kt;
        }
        let mean = match (bridge, p.drive) {
            (Bridge::Driven | Bridge::Shorted, Drive::Voltage) => {
                let volts = if bridge == Bridge::Driven { applied } else { 0.0 };
                let settled = (volts - p.ke * state.omega) * c.conductance;
                let mean = settled + (state.current - settled) * c.mean;
                mean.clamp(-p.current_limit, p.current_limit)
            }
            _ => state.current,
        };
        p.kt * softened(mean, p.kt_knee_a)
    }

    /// Winding resistance with heat and the supply's source (referred through the duty) in the middle of the step.
    fn resistance(&self, state: &State, applied: f64, h: f64) -> f64 {
        let p = self.plant;
        let loss = state.current * state.current * self.coefficients.resistance;
        let heat_w = halfway(state.heat_w, loss, h, p.heat_time_s);
        let mut resistance = p.resistance * (1.0 + p.heat_rise_per_w * heat_w);
        if p.source_ohm > 0.0 && p.bus_farad <= 0.0 {
            let duty = applied / p.supply_v;
            resistance += p.source_ohm * duty * duty;
        }
        resistance
    }

    /// The voltage across the winding before back-EMF (or the torque input); `None`: brushes block the current.
    #[inline]
    fn net_voltage(&self, state: &State, applied: f64, bridge: Bridge, h: f64) -> Option<f64> {
        let p = self.plant;
        if bridge != Bridge::Driven && (bridge == Bridge::Open || p.drive == Drive::Torque) {
            return Some(0.0);
        }
        if p.drive == Drive::Torque {
            return Some(applied.clamp(-p.current_limit, p.current_limit));
        }
        let slow_rail = p.source_ohm > 0.0 && p.bus_farad > 0.0;
        let terminal = match bridge {
            Bridge::Shorted => 0.0,
            _ if slow_rail => {
                let drawn = applied / p.supply_v * state.current;
                let settled = p.supply_v - p.source_ohm * drawn;
                let rail = halfway(state.supply_v, settled, h, p.source_ohm * p.bus_farad);
                applied * rail / p.supply_v
            }
            _ => applied,
        };
        if p.drop_v <= 0.0 { Some(terminal) } else { self.behind_brushes(state, terminal) }
    }

    /// Brushes take their drop from the side to which the current goes; it cannot turn the current round.
    fn behind_brushes(&self, state: &State, terminal: f64) -> Option<f64> {
        let (p, c) = (self.plant, &self.coefficients);
        let settled = (terminal - p.ke * state.omega) * c.conductance;
        let next = settled + (state.current - settled) * c.end;
        let threshold = p.drop_v * c.conductance * (1.0 - c.end);
        (next.abs() > threshold).then(|| terminal - p.drop_v.copysign(next))
    }

    /// Torque at zero mean speed, and the shaft that it moves.
    #[inline]
    fn torque(&self, state: &State, driven: &Driven) -> (f64, Shaft) {
        let (p, c) = (self.plant, &self.coefficients);
        let side = usize::from(state.omega < 0.0);
        match (driven.bridge, p.drive, driven.net) {
            (Bridge::Open, ..) => (0.0, c.open[side]),
            (_, Drive::Torque, net) => {
                let held = net.unwrap_or(0.0);
                (p.force_gain * held * softened(held, p.kt_knee_a), c.open[side])
            }
            (_, Drive::Voltage, Some(net)) => {
                (c.per_volt * net + c.per_ampere * state.current, c.closed[side])
            }
            (_, Drive::Voltage, None) => (c.per_ampere * state.current, c.open[side]),
        }
    }

    /// Speeds of motor and load at the end of the step.
    #[inline]
    fn moved(&self, state: &State, driven: &Driven, loads: &Loads) -> (f64, f64) {
        let (torque, shaft) = self.torque(state, driven);
        let moved = self.pushed(state, torque, &shaft, loads, driven.h);
        let limit = self.plant.current_limit;
        if limit == f64::INFINITY || driven.bridge == Bridge::Open || self.plant.drive == Drive::Torque {
            return moved;
        }
        let (_, mean) = self.currents(state, driven, moved.0);
        if mean.abs() <= limit {
            return moved;
        }
        let torque = self.plant.kt * softened(limit, self.plant.kt_knee_a) * limit.copysign(mean);
        self.pushed(state, torque, &self.coefficients.open[usize::from(state.omega < 0.0)], loads, driven.h)
    }

    #[inline]
    fn pushed(&self, state: &State, torque: f64, shaft: &Shaft, loads: &Loads, h: f64) -> (f64, f64) {
        if self.present.two_bodies {
            return two_bodies::moved(self.plant, state, torque, shaft.damping, loads, h);
        }
        let pushed = shaft.mobility * (torque + loads.motor + loads.load);
        let free = shaft.keep * state.omega + pushed;
        (slowed_from(state.omega, free, pushed, shaft.mobility, loads), 0.0)
    }

    /// Current at the end of the step and its mean, from the speed at the end.
    #[inline]
    fn currents(&self, state: &State, driven: &Driven, omega: f64) -> (f64, f64) {
        let c = &self.coefficients;
        let Some(net) = driven.net else {
            return (0.0, state.current * c.mean);
        };
        let settled = (net - self.plant.ke * 0.5 * (state.omega + omega)) * c.conductance;
        let rest = state.current - settled;
        (settled + rest * c.end, settled + rest * c.mean)
    }

    #[inline]
    fn settle_current(&self, state: &mut State, driven: &Driven, omega: f64) {
        let (end, mean) = match (driven.bridge, self.plant.drive) {
            (Bridge::Open, _) => (0.0, 0.0),
            (_, Drive::Torque) => (driven.net.unwrap_or(0.0), driven.net.unwrap_or(0.0)),
            (_, Drive::Voltage) => self.currents(state, driven, omega),
        };
        let limit = self.plant.current_limit;
        state.current = end.clamp(-limit, limit);
        state.mean_current = mean.clamp(-limit, limit);
        if self.plant.heat_rise_per_w > 0.0 {
            let loss = state.mean_current * state.mean_current / self.coefficients.conductance;
            state.heat_w = loss + (state.heat_w - loss) * (-driven.h / self.plant.heat_time_s).exp();
        }
    }

    fn settle_supply(&self, state: &mut State, applied: f64, h: f64) {
        let p = self.plant;
        let drawn = applied / p.supply_v * state.mean_current;
        let settled = p.supply_v - p.source_ohm * drawn;
        let decay = if p.bus_farad > 0.0 { (-h / (p.source_ohm * p.bus_farad)).exp() } else { 0.0 };
        state.supply_v = settled + (state.supply_v - settled) * decay;
    }

    /// Speeds at the end of the step under torques and friction that depend on the speed: at first with those of its start, then with
    /// those of its middle.
    #[inline]
    fn moved_under_loads(&self, state: &State, driven: &Driven, position: Option<(f64, f64)>) -> (f64, f64) {
        let first = self.moved(state, driven, &self.loads(state, state.omega, driven, position));
        if !self.present.varying_friction && self.plant.torques.is_empty() && !self.present.unnamed {
            return first;
        }
        let middle = 0.5 * (state.omega + first.0);
        self.moved(state, driven, &self.loads(state, middle, driven, position))
    }

    /// What acts on the two sides of the gear at a speed.
    #[inline]
    fn loads(&self, state: &State, omega: f64, driven: &Driven, position: Option<(f64, f64)>) -> Loads {
        let p = self.plant;
        let mut loads =
            Loads { motor: 0.0, load: 0.0, friction_pos: p.friction_pos, friction_neg: p.friction_neg };
        if !p.torques.is_empty() {
            self.external(&mut loads, state, omega, driven.h, position);
        }
        if self.present.unnamed {
            loads.motor += moment::torque(self.plant, &self.coefficients, state, omega, driven, position);
        }
        if self.present.varying_friction {
            let extra = self.extra_friction(state, omega, driven, &loads);
            loads.friction_pos += extra;
            loads.friction_neg += extra;
        }
        loads
    }

    fn external(&self, loads: &mut Loads, state: &State, omega: f64, h: f64, position: Option<(f64, f64)>) {
        let (theta, theta_next) = position.unwrap_or((state.theta, state.theta + h * state.omega));
        let (time_s, gear_ratio) = (state.time_s + 0.5 * h, self.plant.gear_ratio);
        let motion = Motion { time_s, theta, theta_next, omega, gear_ratio };
        for law in &self.plant.torques {
            let torque = (law.torque)(&law.parameters, &motion);
            match law.acts {
                Acts::Motor => loads.motor += torque,
                Acts::Load => loads.load += torque,
                Acts::Friction => {
                    loads.friction_pos += torque;
                    loads.friction_neg += torque;
                }
            }
        }
    }

    /// Breakaway near standstill, and what grows with the torque through the gear.
    fn extra_friction(&self, state: &State, omega: f64, driven: &Driven, loads: &Loads) -> f64 {
        let p = self.plant;
        let ratio = omega / p.stribeck_speed;
        let breakaway =
            if p.breakaway_extra > 0.0 { p.breakaway_extra * (-ratio * ratio).exp() } else { 0.0 };
        let (torque, shaft) = self.torque(state, driven);
        let motor = torque - (shaft.damping - p.viscous) * omega;
        breakaway + p.friction_per_motor * motor.abs() + p.friction_per_load * loads.load.abs()
    }

    #[inline]
    fn settle_load(&self, state: &mut State, before: &Before, omega_load: f64, h: f64) {
        if self.present.two_bodies {
            two_bodies::settle(self.plant, state, before, omega_load, h);
        } else if self.present.play {
            let half = 0.5 * self.plant.gap_rad;
            state.theta_load = before.theta_load.clamp(state.theta - half, state.theta + half);
            state.omega_load = (state.theta_load - before.theta_load) / h;
        } else {
            state.theta_load = state.theta;
            state.omega_load = state.omega;
        }
    }
}

/// A value on its way to where it settles, in the middle of the step.
fn halfway(value: f64, settled: f64, h: f64, time_constant: f64) -> f64 {
    value + (settled - value) * (0.5 * h / time_constant.max(1e-12)).min(1.0)
}

/// Pieces of a step that turns a resonance by so many radians. One beyond half a turn is faster than any log could
/// show; the trapezoid leaves it rigid.
fn resonance_pieces(turned: f64) -> f64 {
    if turned > PI { 2.0 } else { (turned / 0.35).ceil().max(1.0) }
}

/// Pieces of a step in which teeth may touch and part.
fn contact_pieces(turned: f64) -> f64 {
    (turned / 0.35).ceil().clamp(1.0, MOST_CONTACT_PIECES)
}

/// 1/(1 + (current/knee)²).
#[inline]
fn softened(current: f64, knee: f64) -> f64 {
    if knee == f64::INFINITY {
        return 1.0;
    }
    let ratio = current / knee;
    1.0 / (1.0 + ratio * ratio)
}
