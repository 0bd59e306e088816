//! What no entry of the library describes. Each is drawn until it is plainly visible; an analysis must say that
//! something is left, and what it looks like, instead of giving it the nearest name.

use super::base::{Natural, log_range};
use super::hidden::Subject;
use crate::synthetic::reference_plant::{Decay, Friction, Law, Oddity};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// One kind outside the library.
#[derive(Debug)]
pub struct Outsider {
    /// Name in answers and tables.
    pub name: &'static str,
    /// Draws it into the subject; `strength` 0 … 1 from plain to drastic.
    pub put: fn(&mut ChaCha8Rng, f64, &Natural, &mut Subject),
}

fn between(strength: f64, low: f64, high: f64) -> f64 {
    (low.ln() + strength * (high / low).ln()).exp()
}

fn odd(subject: &mut Subject, oddity: Oddity) {
    subject.motor.load.oddity = Some(oddity);
}

/// Every kind outside the library.
pub static OUTSIDERS: &[Outsider] = &[
    // Viscous friction that grows or falls in time.
    Outsider {
        name: "viscosity_drift",
        put: |rng, s, n, subject| {
            let sign = if rng.random_bool(0.5) { 1.0 } else { -0.5 };
            let more = between(s, 0.1, 1.0) * n.torque / n.speed / subject.motor.viscous[0];
            odd(subject, Oddity::ViscosityDrift { rate_per_s: sign * more.max(0.5) / (60.0 * n.tau) });
        },
    },
    // Torque constant that ripples over the rotor's angle.
    Outsider {
        name: "commutation_ripple",
        put: |rng, s, n, subject| {
            let _ = n;
            let periods = f64::from(rng.random_range(2..8));
            odd(subject, Oddity::CommutationRipple { amplitude: between(s, 0.1, 0.5), periods });
        },
    },
    // Springs against each other that push back to rest from either side with a constant torque.
    Outsider {
        name: "preloaded_spring",
        put: |_, s, n, subject| {
            let preload_nm = between(s, 0.05, 0.3) * n.torque;
            subject.motor.load.law = Some(Law {
                torque: |p, theta| -p[0] * (theta / p[1]).tanh(),
                parameters: vec![preload_nm, 0.3 * n.speed * n.tau],
            });
        },
    },
    // Periodic torque whose frequency sweeps.
    Outsider {
        name: "sweeping_load",
        put: |rng, s, n, subject| {
            let start_hz = log_range(rng, 0.1, 0.5) / n.tau;
            let sweep_hz_per_s = log_range(rng, 0.5, 2.0) / n.tau / (60.0 * n.tau);
            odd(
                subject,
                Oddity::SweepingLoad {
                    amplitude_nm: between(s, 0.03, 0.2) * n.torque,
                    start_hz,
                    sweep_hz_per_s,
                },
            );
        },
    },
    // Inertia that depends on the angle.
    Outsider {
        name: "crank_inertia",
        put: |_, s, n, subject| {
            odd(subject, Oddity::CrankInertia { amplitude: between(s, 0.2, 0.7), ratio: n.gear_ratio });
        },
    },
    // Magnetic brake whose torque falls again at high speed.
    Outsider {
        name: "eddy_brake",
        put: |rng, s, n, subject| {
            let peak_rad_s = rng.random_range(0.1..0.25) * n.speed;
            let slope = between(s, 0.15, 1.0) * n.torque / peak_rad_s;
            odd(subject, Oddity::EddyBrake { slope, peak_rad_s });
        },
    },
    // Elastic stop at the ends of the travel.
    Outsider {
        name: "end_stop",
        put: |rng, s, n, subject| {
            let theta0_rad = rng.random_range(1.0..3.0) * n.speed * n.tau;
            let stiffness = between(s, 0.3, 3.0) * n.torque / (n.speed * n.tau);
            odd(subject, Oddity::EndStop { stiffness, theta0_rad });
        },
    },
    // Load that jumps at unknown times.
    Outsider {
        name: "load_steps",
        put: |rng, s, n, subject| {
            let size = between(s, 0.05, 0.3) * n.torque;
            let mut time = 0.0;
            for k in 0..6 {
                time += rng.random_range(4.0..14.0) * n.tau;
                let torque = if k % 2 == 0 { size } else { -size * rng.random_range(0.0..0.8) };
                subject.motor.load.steps.push((time, torque));
            }
        },
    },
    // Random torque, different in every run.
    Outsider {
        name: "random_torque",
        put: |rng, s, n, subject| {
            subject.motor.load.noise_nm = between(s, 0.03, 0.2) * n.torque;
            subject.motor.load.noise_s = log_range(rng, 0.3, 2.0) * n.tau;
        },
    },
    // Dry friction that acts in one sector of each turn.
    Outsider {
        name: "sticking_sector",
        put: |rng, s, n, subject| {
            subject.motor.friction = Friction {
                ripple: rng.random_range(0.85..1.0),
                ripple_periods: f64::from(rng.random_range(1..4)),
                ripple_phase: rng.random_range(0.0..6.0),
                ..Friction::coulomb(between(s, 0.05, 0.25) * n.torque)
            };
        },
    },
    // Drive with fast decay: mean voltage not proportional to the duty.
    Outsider {
        name: "fast_decay",
        put: |_, s, n, subject| {
            // A few electrical time constants a PWM period: the current is discontinuous at small duty.
            let electrical_s = subject.motor.inductance_h / subject.motor.resistance_ohm;
            let pwm_hz = (1.0 / (between(s, 1.0, 6.0) * electrical_s)).min(100.0 / n.tau);
            subject.motor.drive.decay = Decay::Fast { pwm_hz };
        },
    },
    // Supply that wanders slowly.
    Outsider {
        name: "wandering_supply",
        put: |rng, s, n, subject| {
            subject.motor.drive.ripple = between(s, 0.02, 0.15);
            subject.motor.drive.ripple_s = log_range(rng, 2.0, 20.0) * n.tau;
        },
    },
];
