// The simplest motor with friction: 20 rad/s per volt, 40 ms, and a dead zone of 1.2 V. Examples and doctests share it.

use servo::axis::{Bridge, Output, Sample};
use servo::config::Config;

/// What the servo may know of it. A real axis reads this from `axis.toml`.
pub const CONFIG: Config = Config {
    supply_nominal_v: 12.0,
    counts_per_rev: 2048,
    rated_speed_rad_s: 220.0,
    tick_hz: 10_000,
    gear_ratio: 1.0,
    pwm_delay_ticks: 1,
    pwm_full_scale: 4200,
    vbus_v_per_lsb: 0.005,
    current_a_per_lsb: 0.01,
    ..Config::EXAMPLE
};

const GAIN: f64 = 20.0;
const TIME_CONSTANT_S: f64 = 0.04;
const FRICTION_V: f64 = 1.2;

/// Angle and speed of the shaft, and the bridge command that acts from the next tick on.
#[derive(Default)]
pub struct Motor {
    angle: f64,
    speed: f64,
    next: Output,
}

impl Motor {
    /// Where the shaft stands, rad.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// What the board would read now.
    pub fn sample(&self) -> Sample {
        let count = (self.angle * f64::from(CONFIG.counts_per_rev) / std::f64::consts::TAU).floor() as i32;
        Sample { count, ..Sample::NONE }
    }

    /// One tick of motion. A preloaded PWM register acts one tick after it was written.
    pub fn pass(&mut self, output: Output) {
        let acting = std::mem::replace(&mut self.next, output);
        let tick = 1.0 / f64::from(CONFIG.tick_hz);
        let share = f64::from(acting.duty) / f64::from(CONFIG.pwm_full_scale);
        let drive = if acting.bridge == Bridge::Driven { share * 12.0 } else { 0.0 };
        // An open bridge lets the shaft coast: no current, so friction alone brakes it.
        let emf = if acting.bridge == Bridge::Open { 0.0 } else { self.speed / GAIN };
        let acceleration = |volts: f64| volts * GAIN / TIME_CONSTANT_S * tick;
        let free = self.speed + acceleration(drive - emf);
        self.speed = free - free.signum() * acceleration(FRICTION_V).min(free.abs());
        self.angle += self.speed * tick;
    }
}
