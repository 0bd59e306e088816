//! What the firmware may know about its axis before it has moved, in SI units, and the check that every value can be.

use serde::{Deserialize, Serialize};

/// One joint in SI units. The host reads it from `axis.toml`; it reaches the chip in [`crate::protocol::Command::Configure`].
/// Single precision: only `+ − × ÷` and comparisons touch it, which round alike on every IEEE 754 machine, so the
/// fixed-point parameters built from it are the same bits on host and chip.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Nominal supply voltage, V. 1 … 80.
    pub supply_nominal_v: f32,
    /// Encoder counts per revolution of the controlled shaft after ×4 decoding. 4 … 1 000 000.
    pub counts_per_rev: u32,
    /// No-load speed at nominal voltage, rad/s, right within ±30 %.
    pub rated_speed_rad_s: f32,
    /// Control rate, Hz. 1,000 … 20,000.
    pub tick_hz: u32,
    /// Time constant of speed, s, right within a factor of 2; `None`: the chip finds it.
    pub time_constant_hint_s: Option<f32>,
    /// Turns of the controlled shaft per turn of the joint.
    pub gear_ratio: f32,
    /// End stops, rad, relative to power-up; `None`: turns freely.
    pub travel_limit_rad: Option<[f32; 2]>,
    /// Current above which the bridge is switched off, A; `None`: no current sensor or no limit.
    pub current_limit_a: Option<f32>,
    /// Electrical energy that one commissioning may spend, J; `None`: no limit.
    pub energy_limit_j: Option<f32>,
    /// Speed never to be exceeded, rad/s; `None`: no limit.
    pub speed_limit_rad_s: Option<f32>,
    /// Ticks between a command and its effect at the bridge (1: preloaded PWM compare register).
    pub pwm_delay_ticks: u8,
    /// PWM counts of full duty: the timer's reload value.
    pub pwm_full_scale: u16,
    /// Volts per count of the supply converter.
    pub vbus_v_per_lsb: f32,
    /// Amperes per count of the current converter.
    pub current_a_per_lsb: f32,
}
