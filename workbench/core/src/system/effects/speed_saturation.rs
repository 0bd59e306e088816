//! The reading is clamped.

use super::*;

/// The effect.
pub static SPEED_SATURATION: Effect = Effect {
    name: "speed_saturation",
    summary: "the sensor clamps the reading",
    equation: "reading = clamp(ω, ±limit)",
    source: "Doebelin: Measurement Systems, 5th ed., 2003",
    signature: "residual only at speeds above the limit, where the reading is flat and free of noise",
    confusable_with: &[&VOLTAGE_SATURATION, &CURRENT_LIMIT],
    separated_by: "release from full voltage to half: a clamped reading stays flat for a while",
    parameters: &[Parameter::new("limit_rad_s", "rad/s", Scale::Speed, 0.03, 1.5).meaning(Meaning::Ceiling)],
    starts: Starts::Quantiles(Signal::Speed, &[]),
    offered: Offered::Both(Steady::new(Role::Rival, Shape::Limit)),
    apply: |p, plant| plant.sensor_limit = plant.sensor_limit.min(p[0]),
    ..Effect::USUAL
};
