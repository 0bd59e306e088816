//! The motor of the outsiders, and its motion.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use truing::synthetic::cases::base::log_range;

/// Rows a time constant.
pub const ROWS_PER_TAU: usize = 50;

/// A drawn motor.
#[derive(Clone, Copy, Debug)]
pub struct Motor {
    pub volts: f64,
    pub resistance: f64,
    pub inductance: f64,
    pub constant: f64,
    pub inertia: f64,
    pub viscous: f64,
    pub tau: f64,
    /// Steady speed at full voltage, rad/s.
    pub speed: f64,
    /// Torque at standstill and full voltage, N m.
    pub torque: f64,
    pub gear_ratio: f64,
}

impl Motor {
    pub fn draw(rng: &mut ChaCha8Rng) -> Self {
        let volts = [6.0, 12.0, 24.0][rng.random_range(0..3)];
        let resistance = log_range(rng, 0.6, 8.0);
        let constant = log_range(rng, 0.015, 0.12);
        let tau = log_range(rng, 0.06, 0.5);
        let viscous = log_range(rng, 0.02, 0.4) * constant * constant / resistance;
        let damping = constant * constant / resistance + viscous;
        Self {
            volts,
            resistance,
            inductance: log_range(rng, 0.005, 0.05) * tau * resistance,
            constant,
            inertia: tau * damping,
            viscous,
            tau,
            speed: volts * constant / resistance / damping,
            torque: volts * constant / resistance,
            gear_ratio: [1.0, 5.0, 20.0][rng.random_range(0..3)],
        }
    }

    pub fn row_s(&self) -> f64 {
        self.tau / ROWS_PER_TAU as f64
    }
}

/// The motion and what the oddities remember.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    pub time: f64,
    pub theta: f64,
    pub omega: f64,
    pub current: f64,
    /// Speed of a second body.
    pub other: f64,
    /// What a hysteresis remembers.
    pub memory: f64,
    /// What a random walk has come to.
    pub wander: f64,
}
