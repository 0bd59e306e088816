//! The sensor reports the magnitude of the speed.

use super::{Axis, Effect, Family, Form, Starts};

/// The effect.
pub const EFFECT: Effect = Effect {
    name: "sensor_rectified",
    summary: "the sensor reports the magnitude of the speed",
    equation: "reading = |ω|",
    source: "Doebelin: Measurement Systems, 5th ed., 2003",
    signature: "residual 2·|ω| while the speed is negative, nothing else",
    confusable_with: &["encoder_scale"],
    separated_by: "one reversal",
    parameters: &[],
    starts: Starts::Grid(&[&[]]),
    axis: Axis::Any,
    family: Family::Own("sensor_rectified"),
    form: Form::Plain,
    apply: |_, plant| plant.sensor_rectified = true,
};
