//! The reading has a wrong scale (counts per turn, gear ratio, tacho constant).

use super::{Axis, Effect, Family, Form, Parameter, Scale, Starts};

/// The effect.
pub const EFFECT: Effect = Effect {
    name: "encoder_scale",
    summary: "the reading has a wrong scale",
    equation: "reading = ratio·ω, logged position = ratio·θ",
    source: "Doebelin: Measurement Systems, 5th ed., 2003",
    signature: "residual proportional to the speed",
    confusable_with: &["drive_gain", "motor_gain"],
    separated_by: "log the current, or turn the shaft by hand through a known angle",
    parameters: &[Parameter::new("ratio", "1", Scale::One, 0.2, 5.0)],
    starts: Starts::Grid(&[&[0.6], &[0.8], &[0.95], &[1.05], &[1.2], &[1.6]]),
    axis: Axis::Any,
    family: Family::Own("encoder_scale"),
    form: Form::Absorbed,
    apply: |p, plant| plant.sensor_scale *= p[0],
};
