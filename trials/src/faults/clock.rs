//! The requirement's clock: counts that the identified model expects since the moment of the injury.

use crate::families::{Cause, Plant, Truth};
use std::f64::consts::TAU;

/// The linear motor behind its dead zone, as identified, without load.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// Counts per second and volt.
    gain: f64,
    tau_s: f64,
    dead_zone_v: [f64; 2],
    input: bool,
    /// Counts per second.
    speed: f64,
    counts: f64,
    path: f64,
}

impl Clock {
    /// Begins with the shaft at this speed, rad/s. `truth`: what was identified.
    pub fn new(plant: &Plant, truth: &Truth, omega: f64) -> Self {
        let counts_per_rad = f64::from(plant.config.counts_per_rev) / TAU;
        Self {
            gain: truth.gain * counts_per_rad,
            tau_s: truth.time_constant_s,
            dead_zone_v: truth.dead_zone_v,
            input: truth.cause == Cause::Input,
            speed: omega * counts_per_rad,
            counts: 0.0,
            path: 0.0,
        }
    }

    /// One tick with this voltage at the terminals; farthest expected travel so far, counts.
    pub fn pass(&mut self, volts: f64, tick_s: f64) -> f64 {
        let swallow = |v: f64, sign: f64| v - sign * self.dead_zone_v[usize::from(sign < 0.0)];
        let sticks = volts.abs() <= self.dead_zone_v[usize::from(volts < 0.0)];
        let sign = if self.input || self.speed == 0.0 { volts.signum() } else { self.speed.signum() };
        let drive = match (self.input, sticks) {
            (true, true) => 0.0,
            (false, true) if self.speed == 0.0 => 0.0,
            _ => swallow(volts, sign),
        };
        let before = self.speed;
        self.speed += (self.gain * drive - self.speed) * (1.0 - (-tick_s / self.tau_s).exp());
        if !self.input && before * self.speed < 0.0 {
            // Friction stops it; it breaks away anew in the next tick, if it does.
            self.speed = 0.0;
        }
        self.counts += self.speed * tick_s;
        self.path = self.path.max(self.counts.abs());
        self.path
    }
}
