//! The reading has an offset.

use super::*;

/// The effect.
pub static SENSOR_OFFSET: Effect = Effect {
    name: "sensor_offset",
    summary: "the sensor adds a constant",
    equation: "reading = ω + offset",
    source: "Doebelin: Measurement Systems, 5th ed., 2003",
    signature: "constant residual, also at rest",
    confusable_with: &[&VOLTAGE_OFFSET, &CONSTANT_LOAD],
    separated_by: "standstill with the bridge open",
    parameters: &[Parameter::new("offset", "rad/s", Scale::Speed, -0.5, 0.5)],
    starts: Starts::Grid(&[&[-0.05], &[-0.01], &[0.01], &[0.05]]),
    offered: Offered::Both(Steady::new(Role::Representative, Shape::ZeroCrossing)),
    apply: |p, plant| plant.sensor_offset += p[0],
    ..Effect::USUAL
};
