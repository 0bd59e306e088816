//! How the loops that the firmware designs are shaped: crossover and phase margin.
//!
//! The firmware derives its gains from what it knows, and the same library does so here, bit by bit. Broken at the voltage
//! behind the compensated dead zone, with all rates per control tick, the loop is
//!
//! ```text
//! L(s) = ω₀/(τs + 1) · (k_v + k_v·k_p/s + k_i/s²) · e^(−s(D + ½))      D: ticks of the PWM's delay, ½: its hold
//! ```
//!
//! The speed's observer is left out: inside its bandwidth it knows the motor and adds no lag.

use crate::device::place_load::designed;
use nalgebra::Complex;
use servo::config::Config;
use servo::control::{Gains, Tuning};
use servo::encoder::Motor;
use servo::identify::estimate::Estimates;
use servo::store::AxisParameters;

/// Shape of the position loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopShape {
    /// Where |L| falls below one for good, rad/s.
    pub crossover_rad_s: f64,
    /// Distance of its phase there from −180°.
    pub phase_margin_deg: f64,
}

/// Frequencies that are searched, rad per tick, and steps per octave.
const LOWEST: f64 = 1e-7;
const HIGHEST: f64 = std::f64::consts::PI;
const STEPS: f64 = 16.0;

impl LoopShape {
    /// Of the loops that the firmware designs with this configuration and tuning once it knows this; `None`: |L| is never
    /// one.
    pub fn of(config: &Config, tuning: Tuning, known: &Estimates) -> Option<Self> {
        let design = designed(&AxisParameters { tuning, estimates: *known, ..AxisParameters::new(*config) })?;
        let delay = f64::from(config.pwm_delay_ticks);
        let shape = Self::new(&design.motor, &design.loops.gains(), delay);
        let tick_hz = f64::from(config.tick_hz);
        shape.map(|shape| Self { crossover_rad_s: shape.crossover_rad_s * tick_hz, ..shape })
    }

    /// In units of the control tick.
    pub fn new(motor: &Motor, gains: &Gains, delay_ticks: f64) -> Option<Self> {
        let magnitude = |w: f64| open_loop(motor, gains, delay_ticks, w).norm();
        let mut high = HIGHEST;
        while magnitude(high) < 1.0 {
            high *= 2f64.powf(-1.0 / STEPS);
            if high < LOWEST {
                return None;
            }
        }
        let mut low = high;
        high *= 2f64.powf(1.0 / STEPS);
        for _ in 0..60 {
            let middle = (low * high).sqrt();
            *(if magnitude(middle) < 1.0 { &mut high } else { &mut low }) = middle;
        }
        let phase = (-open_loop(motor, gains, delay_ticks, low)).arg();
        Some(Self { crossover_rad_s: low, phase_margin_deg: phase.to_degrees() })
    }
}

fn open_loop(motor: &Motor, gains: &Gains, delay_ticks: f64, w: f64) -> Complex<f64> {
    let s = Complex::new(0.0, w);
    let [position, speed, integral] = [gains.position, gains.speed, gains.integral].map(f64::from);
    let plant = f64::from(motor.full_speed) / (s * f64::from(motor.tau_ticks) + 1.0);
    let control = speed + speed * position / s + integral / (s * s);
    plant * control * (-s * (delay_ticks + 0.5)).exp()
}
