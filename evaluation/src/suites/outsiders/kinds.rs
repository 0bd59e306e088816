//! Kinds of outsiders: what acts, and the variables by which a person would describe it.

use super::motor::{Motor, State};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use truing::synthetic::cases::base::log_range;

/// One kind.
pub struct Kind {
    /// Name in tables.
    pub name: &'static str,
    /// Variables of which one must be told; none: it is noise.
    pub right: &'static [&'static str],
    /// Draws its numbers.
    pub draw: fn(&mut ChaCha8Rng, &Motor) -> Oddity,
}

/// What acts. Torques in N m, angles in rad, speeds in rad/s, times in s.
#[derive(Clone, Copy, Debug)]
pub enum Oddity {
    None,
    /// Torque that follows the motion over a way before it is fully opposed (Dahl with a long way).
    Hysteresis {
        torque: f64,
        way: f64,
    },
    /// Damping by an orifice with a relief valve that opens one way.
    Orifice {
        drag: f64,
        opens: f64,
    },
    /// Voltage lost to the dead time of the bridge, softly around zero current.
    DeadTime {
        volts: f64,
        soft_a: f64,
    },
    /// The encoder's disc is off centre.
    Eccentric {
        part: f64,
        phase: f64,
    },
    /// A second body is gripped by shoes that fly out.
    Centrifugal {
        grip: f64,
        from: f64,
        inertia: f64,
        drag: f64,
    },
    /// Inertia over the turn.
    Crank {
        part: f64,
        phase: f64,
        turns: f64,
    },
    /// Dry friction that belongs to a place of the travel.
    WornSpot {
        torque: f64,
        at: f64,
        width: f64,
    },
    /// A torque that wanders.
    Wander {
        torque: f64,
        time: f64,
    },
    /// A second body on a belt that slips.
    Belt {
        grip: f64,
        inertia: f64,
    },
    /// A load between two times.
    LoadStep {
        torque: f64,
        from: f64,
        to: f64,
    },
    /// Springs that push back to the middle with a constant torque.
    Preload {
        torque: f64,
        width: f64,
    },
    /// A fan whose flow separates at one speed and closes again at a lower one.
    Fan {
        drag: f64,
        more: f64,
        up: f64,
        down: f64,
    },
    /// A sawtooth over the turn that acts forwards alone.
    Ratchet {
        torque: f64,
        turns: f64,
    },
    /// Friction that is high after a reversal and relaxes in time.
    Relaxing {
        torque: f64,
        time: f64,
    },
    /// Viscous friction of cold grease that warms up.
    Grease {
        viscous: f64,
        time: f64,
    },
    /// Friction of a seal: highest in the middle of the speeds.
    Seal {
        torque: f64,
        peak: f64,
    },
}

impl Oddity {
    /// Torque beside that of the motor, and the inertia that it moves.
    pub fn acts(&self, s: &mut State, m: &Motor, push: f64, h: f64) -> (f64, f64) {
        let plain = |torque: f64| (torque, m.inertia);
        match *self {
            Self::Hysteresis { torque, .. } => plain(-torque * s.memory),
            Self::Orifice { drag, opens } => {
                let square = drag * s.omega * s.omega.abs();
                plain(if s.omega > opens { -drag * opens * opens } else { -square })
            }
            Self::Centrifugal { grip, from, inertia, drag } => {
                let most = grip * (s.omega * s.omega - from * from).max(0.0);
                let torque = second_body(s, most, inertia, drag, h);
                plain(-torque)
            }
            Self::Crank { part, phase, turns } => {
                let angle = turns * s.theta + phase;
                let bend = -0.5 * m.inertia * part * turns * angle.sin() * s.omega * s.omega;
                (-bend, m.inertia * (1.0 + part * angle.cos()))
            }
            Self::Wander { .. } => plain(s.wander),
            Self::Belt { grip, inertia } => plain(-second_body(s, grip, inertia, 0.0, h)),
            Self::LoadStep { torque, from, to } => {
                plain(if s.time > from && s.time < to { torque } else { 0.0 })
            }
            Self::Preload { torque, width } => plain(-torque * (s.theta / width).tanh()),
            Self::Fan { drag, more, .. } => plain(-drag * (1.0 + more * s.memory) * s.omega * s.omega.abs()),
            Self::Ratchet { torque, turns } => {
                let saw = (turns * s.theta / TAU).rem_euclid(1.0);
                plain(if s.omega > 0.0 { -torque * saw } else { 0.0 })
            }
            Self::Grease { viscous, time } => plain(-viscous * (-s.time / time).exp() * s.omega),
            Self::Seal { torque, peak } => {
                let ratio = s.omega / peak;
                plain(-2.0 * torque * ratio / (1.0 + ratio * ratio))
            }
            _ => {
                let _ = push;
                plain(0.0)
            }
        }
    }

    /// Level of dry friction.
    pub fn friction(&self, s: &State) -> f64 {
        match *self {
            Self::WornSpot { torque, at, width } => torque * (-((s.theta - at) / width).powi(2)).exp(),
            Self::Relaxing { torque, .. } => torque * s.memory.abs(),
            _ => 0.0,
        }
    }

    /// Voltage beside the command.
    pub fn volts(&self, s: &State) -> f64 {
        match *self {
            Self::DeadTime { volts, soft_a } => -volts * (s.current / soft_a).tanh(),
            _ => 0.0,
        }
    }

    /// What the sensor shows of position and speed.
    pub fn seen(&self, s: &State) -> (f64, f64) {
        match *self {
            Self::Eccentric { part, phase } => {
                (s.theta + part * (s.theta + phase).sin(), s.omega * (1.0 + part * (s.theta + phase).cos()))
            }
            _ => (s.theta, s.omega),
        }
    }

    /// A new random torque.
    pub fn wander(&self, s: &mut State, kick: f64, h: f64) {
        if let Self::Wander { torque, time } = *self {
            let keep = (-h / time).exp();
            s.wander = keep * s.wander + torque * (1.0 - keep * keep).sqrt() * kick;
        }
    }

    /// What the oddity keeps of the motion.
    pub fn remember(&self, s: &mut State, h: f64) {
        match *self {
            Self::Hysteresis { way, .. } => {
                let moved = h * s.omega / way;
                s.memory += moved * (1.0 - s.memory * s.omega.signum());
            }
            Self::Fan { up, down, .. } => {
                let speed = s.omega.abs();
                s.memory = if speed > up {
                    1.0
                } else if speed < down {
                    0.0
                } else {
                    s.memory
                };
            }
            Self::Relaxing { time, .. } => {
                // The sign is the direction; the size is how much of the peak is left.
                let turned = s.omega * s.memory < 0.0 || (s.memory == 0.0 && s.omega != 0.0);
                let left = if turned { 1.0 } else { s.memory.abs() * (-h / time).exp() };
                s.memory = left.max(1e-12).copysign(if s.omega == 0.0 { s.memory } else { s.omega });
            }
            _ => {}
        }
    }
}

/// A second body behind a dry clutch that transmits at most so much; returns the torque that it takes.
fn second_body(s: &mut State, most: f64, inertia: f64, drag: f64, h: f64) -> f64 {
    let wanted = (s.omega - s.other) * inertia / h;
    let torque = wanted.clamp(-most, most);
    s.other += h * (torque - drag * s.other) / inertia;
    torque
}

/// Every kind.
pub const KINDS: [Kind; 16] = [
    Kind {
        name: "hysteresis_brake",
        right: &["travel_since_reversal"],
        draw: |rng, m| Oddity::Hysteresis {
            torque: log_range(rng, 0.05, 0.3) * m.torque,
            way: log_range(rng, 0.1, 0.6) * m.speed * m.tau,
        },
    },
    Kind {
        name: "orifice_damper",
        right: &["speed"],
        draw: |rng, m| Oddity::Orifice {
            drag: log_range(rng, 0.2, 1.5) * m.torque / (m.speed * m.speed),
            opens: rng.random_range(0.2..0.5) * m.speed,
        },
    },
    Kind {
        name: "bridge_dead_time",
        right: &["current"],
        draw: |rng, m| Oddity::DeadTime {
            volts: log_range(rng, 0.03, 0.12) * m.volts,
            soft_a: log_range(rng, 0.05, 0.3) * m.volts / m.resistance,
        },
    },
    Kind {
        name: "eccentric_encoder",
        right: &["turn_of_motor"],
        draw: |rng, _| Oddity::Eccentric {
            part: log_range(rng, 0.03, 0.2),
            phase: rng.random_range(0.0..TAU),
        },
    },
    Kind {
        name: "centrifugal_clutch",
        right: &["speed", "acceleration"],
        draw: |rng, m| {
            let from = rng.random_range(0.3..0.6) * m.speed;
            Oddity::Centrifugal {
                grip: log_range(rng, 0.5, 3.0) * m.torque / (m.speed * m.speed),
                from,
                inertia: rng.random_range(0.3..1.0) * m.inertia,
                drag: log_range(rng, 0.05, 0.3) * m.torque / m.speed,
            }
        },
    },
    Kind {
        name: "crank_inertia",
        right: &["turn_of_motor", "turn_of_load", "position"],
        draw: |rng, m| Oddity::Crank {
            part: rng.random_range(0.3..0.7),
            phase: rng.random_range(0.0..TAU),
            turns: 1.0 / m.gear_ratio,
        },
    },
    Kind {
        name: "worn_spot",
        right: &["position"],
        draw: |rng, m| Oddity::WornSpot {
            torque: log_range(rng, 0.08, 0.3) * m.torque,
            at: rng.random_range(-2.0..2.0) * m.speed * m.tau,
            width: rng.random_range(0.6..2.0) * m.speed * m.tau,
        },
    },
    Kind {
        name: "wandering_torque",
        right: &[],
        draw: |rng, m| Oddity::Wander {
            torque: log_range(rng, 0.03, 0.2) * m.torque,
            time: log_range(rng, 0.3, 3.0) * m.tau,
        },
    },
    Kind {
        name: "slipping_belt",
        right: &["acceleration", "current", "input"],
        draw: |rng, m| Oddity::Belt {
            grip: log_range(rng, 0.05, 0.25) * m.torque,
            inertia: rng.random_range(0.4..1.5) * m.inertia,
        },
    },
    Kind {
        name: "load_step",
        right: &["time"],
        draw: |rng, m| {
            let from = rng.random_range(10.0..25.0) * m.tau;
            Oddity::LoadStep {
                torque: log_range(rng, 0.08, 0.3) * m.torque,
                from,
                to: from + rng.random_range(10.0..25.0) * m.tau,
            }
        },
    },
    Kind {
        name: "preloaded_spring",
        right: &["position"],
        draw: |rng, m| Oddity::Preload {
            torque: log_range(rng, 0.05, 0.3) * m.torque,
            width: log_range(rng, 0.1, 0.6) * m.speed * m.tau,
        },
    },
    Kind {
        name: "separating_fan",
        right: &["speed"],
        draw: |rng, m| {
            let up = rng.random_range(0.5..0.7) * m.speed;
            Oddity::Fan {
                drag: log_range(rng, 0.1, 0.4) * m.torque / (m.speed * m.speed),
                more: rng.random_range(0.8..2.5),
                up,
                down: rng.random_range(0.5..0.8) * up,
            }
        },
    },
    Kind {
        name: "ratchet",
        right: &["turn_of_motor"],
        draw: |rng, m| Oddity::Ratchet {
            torque: log_range(rng, 0.1, 0.4) * m.torque,
            turns: f64::from(rng.random_range(1..4)),
        },
    },
    Kind {
        name: "relaxing_friction",
        right: &["time_since_reversal", "travel_since_reversal"],
        draw: |rng, m| Oddity::Relaxing {
            torque: log_range(rng, 0.1, 0.4) * m.torque,
            time: log_range(rng, 0.2, 1.0) * m.tau,
        },
    },
    Kind {
        name: "warming_grease",
        right: &["time"],
        draw: |rng, m| Oddity::Grease {
            viscous: log_range(rng, 0.2, 1.0) * m.torque / m.speed,
            time: rng.random_range(8.0..25.0) * m.tau,
        },
    },
    Kind {
        name: "lip_seal",
        right: &["speed"],
        draw: |rng, m| Oddity::Seal {
            torque: log_range(rng, 0.05, 0.25) * m.torque,
            peak: rng.random_range(0.15..0.4) * m.speed,
        },
    },
];
