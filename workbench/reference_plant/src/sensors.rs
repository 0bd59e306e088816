//! Sensors: what the log or the firmware sees of the true motion.
//!
//! ```text
//! speed  : true → × scale → |·| → lag → clamp → mean over the window → + offset → + noise
//! count  : ⌊θ·C/2π + e sin(π/2 · θ·C/2π + φ)⌋ − counts missed
//! current, supply : true → delay → + noise → quantisation
//! ```

use super::noise::GaussMarkov;
use super::rosenbrock::State;
use super::state::{SENSED, SENSED_ANGLE};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A speed sensor in front of its window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tacho {
    /// Ratio of reading to truth.
    pub scale: f64,
    /// True if the sign is lost.
    pub rectified: bool,
    /// First-order lag, s; 0: none.
    pub lag_s: f64,
    /// Largest reading, rad/s; infinite: none.
    pub limit_rad_s: f64,
    /// True if it sits at the load of a train of two bodies.
    pub on_load: bool,
}

impl Default for Tacho {
    fn default() -> Self {
        Self { scale: 1.0, rectified: false, lag_s: 0.0, limit_rad_s: f64::INFINITY, on_load: false }
    }
}

impl Tacho {
    /// Adds the rates of the sensor's own states.
    pub fn rates(&self, omega: f64, y: &State, rate: &mut State) {
        let mut seen = self.scale * omega;
        if self.rectified {
            seen = seen.abs();
        }
        if self.lag_s > 0.0 {
            rate[SENSED] = (seen - y[SENSED]) / self.lag_s;
            seen = y[SENSED];
        }
        rate[SENSED_ANGLE] = seen.clamp(-self.limit_rad_s, self.limit_rad_s);
    }
}

/// An incremental encoder with its faults.
#[derive(Clone, Debug)]
pub struct Encoder {
    counts_per_rad: f64,
    phase_error: f64,
    phase: f64,
    missing: f64,
    rng: ChaCha8Rng,
    last_edge: i64,
    missed: i64,
}

impl Encoder {
    /// `counts_per_rev` after ×4 decoding; `phase_error` in counts, below 0.6 so that edges keep their order.
    pub fn new(counts_per_rev: u32, phase_error: f64, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let phase = rng.random_range(0.0..TAU);
        let counts_per_rad = f64::from(counts_per_rev) / TAU;
        Self { counts_per_rad, phase_error, phase, missing: 0.0, rng, last_edge: 0, missed: 0 }
    }

    /// Loses each edge with this probability.
    pub fn losing(mut self, probability: f64) -> Self {
        self.missing = probability;
        self
    }

    /// The count at this angle. Call it in the order of time.
    pub fn count(&mut self, theta: f64) -> i64 {
        let x = theta * self.counts_per_rad;
        let edge = (x + self.phase_error * (FRAC_PI_2 * x + self.phase).sin()).floor() as i64;
        let passed = edge - self.last_edge;
        self.last_edge = edge;
        if self.missing > 0.0 && passed != 0 {
            let lost =
                (0..passed.abs().min(10_000)).filter(|_| self.rng.random_bool(self.missing)).count() as i64;
            self.missed += lost * passed.signum();
        }
        edge - self.missed
    }
}

/// A converter: delay in samples, noise, quantisation.
#[derive(Clone, Debug)]
pub struct Converter {
    noise: GaussMarkov,
    lsb: f64,
    queue: VecDeque<f64>,
    delay: usize,
}

impl Converter {
    /// White noise of this rms; `lsb` 0: no quantisation; `delay` in readings.
    pub fn new(rms: f64, lsb: f64, delay: usize, seed: u64) -> Self {
        Self { noise: GaussMarkov::new(rms, 0.0, seed), lsb, queue: VecDeque::new(), delay }
    }

    /// The reading of this value.
    pub fn read(&mut self, value: f64) -> f64 {
        self.queue.push_back(value);
        let seen =
            if self.queue.len() > self.delay { self.queue.pop_front() } else { self.queue.front().copied() };
        let noisy = seen.unwrap_or(value) + self.noise.next_value();
        if self.lsb > 0.0 { (noisy / self.lsb).round() * self.lsb } else { noisy }
    }
}
