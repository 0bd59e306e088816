//! One step of winding, friction and inertia.
//!
//! The winding is solved exactly for a constant mean back-EMF, so that a small L/R costs no small steps; speed and
//! back-EMF are coupled implicitly (trapezoid), so that no motor is too fast; friction acts as a proximal step
//! (Acary, Brogliato: Numerical Methods for Nonsmooth Dynamical Systems, 2008): true sticking without switching logic.

use super::physics::{Drive, Motion, Physics};
use super::state::State;

/// Bridge modes of a log.
pub mod bridge {
    /// Open: no current.
    pub const OPEN: u8 = 0;
    /// Driven.
    pub const DRIVEN: u8 = 1;
    /// Shorted terminals.
    pub const SHORTED: u8 = 2;
}

/// Advances a [`State`]. Keeps the winding's decay of the last step length.
#[derive(Clone, Debug)]
pub struct Dynamics<'a> {
    plant: &'a Physics,
    decay_of: (f64, f64),
    decay: Decay,
    two_bodies: bool,
}

/// Decay of the winding current over one step: at its end, and as the mean over it.
#[derive(Clone, Copy, Debug, Default)]
struct Decay {
    end: f64,
    mean: f64,
}

/// The motor's torque over one step: `torque − damping·(mean speed)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    pub torque: f64,
    pub damping: f64,
}

/// External torques on the two sides of the gear, and the friction level in either direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loads {
    pub motor: f64,
    pub load: f64,
    pub friction_pos: f64,
    pub friction_neg: f64,
}

impl<'a> Dynamics<'a> {
    /// For a plant.
    pub fn new(plant: &'a Physics) -> Self {
        let two_bodies = plant.load_share > 0.0 && (plant.gap_rad > 0.0 || plant.stiffness.is_finite());
        Self {
            plant,
            decay_of: (f64::NAN, f64::NAN),
            decay: Decay::default(),
            two_bodies,
        }
    }

    /// Advances by `h` seconds with a constant voltage (or torque input) behind the input chain. `position`: where
    /// the shaft is known to be at start and end of the step (measured), for torques that depend on it.
    pub fn advance(
        &mut self,
        state: &mut State,
        applied: f64,
        bridge: u8,
        h: f64,
        position: Option<(f64, f64)>,
    ) {
        if !self.two_bodies {
            return self.step(state, applied, bridge, h, position);
        }
        let pieces = (h * self.plant.resonance_rad_s() / 0.25).ceil().clamp(1.0, 40.0);
        for piece in 0..pieces as usize {
            let part = |k: usize| position.map(|(from, to)| from + (to - from) * k as f64 / pieces);
            self.step(
                state,
                applied,
                bridge,
                h / pieces,
                part(piece).zip(part(piece + 1)),
            );
        }
    }

    fn step(&mut self, state: &mut State, applied: f64, bridge: u8, h: f64, position: Option<(f64, f64)>) {
        let before = *state;
        let resistance = self.resistance(state, applied);
        let applied = self.sagged(state, applied);
        let drawn = self.drawn(state, applied, resistance, bridge, h);
        let loads = self.loads(state, &drawn, h, position);
        let (omega, omega_load) = self.moved(state, &drawn, &loads, h);
        let (omega, omega_load) = match self.limited(state, applied, resistance, bridge, h, omega) {
            Some(drawn) => self.moved(state, &drawn, &loads, h),
            None => (omega, omega_load),
        };
        self.settle_current(state, applied, resistance, bridge, h, omega);
        self.settle_supply(state, applied, h);
        state.time_s += h;
        state.theta += 0.5 * h * (before.omega + omega);
        state.omega = omega;
        self.settle_load(state, &before, omega_load, h);
        self.plant.sense(state, &before, h);
    }

    /// Winding resistance with heat and the supply's source (referred through the duty).
    #[inline]
    fn resistance(&self, state: &State, applied: f64) -> f64 {
        let p = self.plant;
        let mut resistance = p.resistance * (1.0 + p.heat_rise_per_w * state.heat_w);
        if p.source_ohm > 0.0 && p.bus_farad <= 0.0 {
            let duty = applied / p.supply_v;
            resistance += p.source_ohm * duty * duty;
        }
        resistance
    }

    /// The applied voltage scaled by a rail that follows with a lag.
    #[inline]
    fn sagged(&self, state: &State, applied: f64) -> f64 {
        let slow = self.plant.source_ohm > 0.0 && self.plant.bus_farad > 0.0;
        if slow {
            applied * state.supply_v / self.plant.supply_v
        } else {
            applied
        }
    }

    #[inline]
    fn kt(&self, current: f64) -> f64 {
        let ratio = current / self.plant.kt_knee_a;
        self.plant.kt / (1.0 + ratio * ratio)
    }

    /// Torque of a torque-driven axis from its input.
    fn held_torque(&self, applied: f64) -> f64 {
        let held = applied.clamp(-self.plant.current_limit, self.plant.current_limit);
        let ratio = held / self.plant.kt_knee_a;
        self.plant.force_gain * held / (1.0 + ratio * ratio)
    }

    fn drawn(&mut self, state: &State, applied: f64, resistance: f64, bridge: u8, h: f64) -> Drawn {
        let p = self.plant;
        if bridge == bridge::OPEN {
            return Drawn {
                torque: 0.0,
                damping: 0.0,
            };
        }
        if p.drive == Drive::Torque {
            let torque = if bridge == bridge::SHORTED {
                0.0
            } else {
                self.held_torque(applied)
            };
            return Drawn { torque, damping: 0.0 };
        }
        self.renew_decay(resistance, h);
        let kt = self.kt(state.current);
        match self.net_voltage(state, applied, resistance, bridge, state.omega) {
            Some(net) => {
                let share = 1.0 - self.decay.mean;
                let torque = kt * (net / resistance * share + state.current * self.decay.mean);
                Drawn {
                    torque,
                    damping: kt * p.ke / resistance * share,
                }
            }
            None => Drawn {
                torque: kt * state.current * self.decay.mean,
                damping: 0.0,
            },
        }
    }

    /// The voltage across the winding before back-EMF; `None`: brushes block the current.
    #[inline]
    fn net_voltage(
        &self,
        state: &State,
        applied: f64,
        resistance: f64,
        bridge: u8,
        omega: f64,
    ) -> Option<f64> {
        let p = self.plant;
        let terminal = if bridge == bridge::SHORTED { 0.0 } else { applied };
        if p.drop_v <= 0.0 {
            return Some(terminal);
        }
        let settled = (terminal - p.ke * omega) / resistance;
        let next = settled + (state.current - settled) * self.decay.end;
        let threshold = p.drop_v / resistance * (1.0 - self.decay.end);
        (next.abs() > threshold).then(|| terminal - p.drop_v.copysign(next))
    }

    fn renew_decay(&mut self, resistance: f64, h: f64) {
        if self.decay_of == (resistance, h) {
            return;
        }
        self.decay_of = (resistance, h);
        let x = resistance * h / self.plant.inductance.max(1e-12);
        let end = (-x).exp();
        self.decay = Decay {
            end,
            mean: if x < 1e-6 { 1.0 - 0.5 * x } else { (1.0 - end) / x },
        };
    }

    /// When the current would exceed its limit: the torque that is left.
    fn limited(
        &self,
        state: &State,
        applied: f64,
        resistance: f64,
        bridge: u8,
        h: f64,
        omega: f64,
    ) -> Option<Drawn> {
        let limit = self.plant.current_limit;
        if !limit.is_finite() || bridge == bridge::OPEN || self.plant.drive == Drive::Torque {
            return None;
        }
        let (_, mean) = self.currents(state, applied, resistance, bridge, h, omega);
        (mean.abs() > limit).then(|| Drawn {
            torque: self.kt(limit) * limit.copysign(mean),
            damping: 0.0,
        })
    }

    /// Current at the end of the step and its mean, from the speed at the end.
    #[inline]
    fn currents(
        &self,
        state: &State,
        applied: f64,
        resistance: f64,
        bridge: u8,
        _h: f64,
        omega: f64,
    ) -> (f64, f64) {
        let mean_speed = 0.5 * (state.omega + omega);
        match self.net_voltage(state, applied, resistance, bridge, state.omega) {
            Some(net) => {
                let settled = (net - self.plant.ke * mean_speed) / resistance;
                let rest = state.current - settled;
                (settled + rest * self.decay.end, settled + rest * self.decay.mean)
            }
            None => (0.0, state.current * self.decay.mean),
        }
    }

    fn settle_current(
        &self,
        state: &mut State,
        applied: f64,
        resistance: f64,
        bridge: u8,
        h: f64,
        omega: f64,
    ) {
        let (end, mean) = match (bridge, self.plant.drive) {
            (bridge::OPEN, _) => (0.0, 0.0),
            (_, Drive::Torque) => (applied, applied),
            (_, Drive::Voltage) => self.currents(state, applied, resistance, bridge, h, omega),
        };
        let limit = self.plant.current_limit;
        state.current = end.clamp(-limit, limit);
        state.mean_current = mean.clamp(-limit, limit);
        if self.plant.heat_rise_per_w > 0.0 {
            let loss = state.mean_current * state.mean_current * resistance;
            state.heat_w = loss + (state.heat_w - loss) * (-h / self.plant.heat_time_s).exp();
        }
    }

    fn settle_supply(&self, state: &mut State, applied: f64, h: f64) {
        let p = self.plant;
        if p.source_ohm <= 0.0 {
            return;
        }
        let drawn = applied / p.supply_v * state.mean_current;
        let settled = p.supply_v - p.source_ohm * drawn;
        let decay = if p.bus_farad > 0.0 {
            (-h / (p.source_ohm * p.bus_farad)).exp()
        } else {
            0.0
        };
        state.supply_v = settled + (state.supply_v - settled) * decay;
    }

    fn loads(&self, state: &State, drawn: &Drawn, h: f64, position: Option<(f64, f64)>) -> Loads {
        let p = self.plant;
        let mut loads = Loads {
            motor: 0.0,
            load: 0.0,
            friction_pos: p.friction_pos,
            friction_neg: p.friction_neg,
        };
        if !p.torques.is_empty() {
            let (theta, theta_next) = position.unwrap_or((state.theta, state.theta + h * state.omega));
            let motion = Motion {
                time_s: state.time_s + 0.5 * h,
                theta,
                theta_next,
                omega: state.omega,
                gear_ratio: p.gear_ratio,
            };
            for law in &p.torques {
                let torque = (law.torque)(&law.parameters, &motion);
                *(if law.at_load {
                    &mut loads.load
                } else {
                    &mut loads.motor
                }) += torque;
            }
        }
        let mut extra = 0.0;
        if p.breakaway_extra > 0.0 {
            let ratio = state.omega / p.stribeck_speed;
            extra += p.breakaway_extra * (-ratio * ratio).exp();
        }
        if p.friction_per_motor > 0.0 || p.friction_per_load > 0.0 {
            let motor = drawn.torque - drawn.damping * state.omega;
            extra += p.friction_per_motor * motor.abs() + p.friction_per_load * loads.load.abs();
        }
        loads.friction_pos += extra;
        loads.friction_neg += extra;
        loads
    }

    /// Speeds of motor and load at the end of the step.
    #[inline]
    fn moved(&self, state: &State, drawn: &Drawn, loads: &Loads, h: f64) -> (f64, f64) {
        let p = self.plant;
        let uneven = if state.omega >= 0.0 {
            p.viscous_pos
        } else {
            p.viscous_neg
        };
        let damping = p.viscous + uneven + drawn.damping;
        if self.two_bodies {
            return super::two_bodies::moved(p, state, drawn.torque, damping, loads, h);
        }
        let half = 0.5 * h * damping / p.inertia;
        let mobility = h / p.inertia / (1.0 + half);
        let torque = drawn.torque + loads.motor + loads.load;
        let free = state.omega * (1.0 - half) / (1.0 + half) + mobility * torque;
        (slowed(free, mobility, loads), 0.0)
    }

    fn settle_load(&self, state: &mut State, before: &State, omega_load: f64, h: f64) {
        let p = self.plant;
        if self.two_bodies {
            super::two_bodies::settle(p, state, before, omega_load, h);
        } else if p.gap_rad > 0.0 {
            let half = 0.5 * p.gap_rad;
            state.theta_load = before.theta_load.clamp(state.theta - half, state.theta + half);
            state.omega_load = (state.theta_load - before.theta_load) / h;
        } else {
            state.theta_load = state.theta;
            state.omega_load = state.omega;
        }
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
