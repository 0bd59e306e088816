//! The reading has an offset.

use super::{Axis, Effect, Family, Form, Parameter, Scale, Starts};

/// The effect.
pub const EFFECT: Effect = Effect {
    name: "sensor_offset",
    summary: "the sensor adds a constant",
    equation: "reading = ω + offset",
    source: "Doebelin: Measurement Systems, 5th ed., 2003",
    signature: "constant residual, also at rest",
    confusable_with: &["voltage_offset", "constant_load"],
    separated_by: "standstill with the bridge open",
    parameters: &[Parameter::new("offset", "rad/s", Scale::Speed, -0.5, 0.5)],
    starts: Starts::Grid(&[&[-0.05], &[-0.01], &[0.01], &[0.05]]),
    axis: Axis::Any,
    family: Family::Own("sensor_offset"),
    form: Form::Plain,
    apply: |p, plant| plant.sensor_offset += p[0],
};
