//! The sensor reports the magnitude of the speed.

use super::*;

/// The effect.
pub static SENSOR_RECTIFIED: Effect = Effect {
    name: "sensor_rectified",
    summary: "the sensor reports the magnitude of the speed",
    equation: "reading = |ω|",
    source: "Doebelin: Measurement Systems, 5th ed., 2003",
    signature: "residual 2·|ω| while the speed is negative, nothing else",
    confusable_with: &[&ENCODER_SCALE],
    separated_by: "one reversal",
    parameters: &[],
    starts: Starts::Grid(&[&[]]),
    offered: Offered::Both(Steady::new(Role::Representative, Shape::Own).needs(Needs::Magnitudes)),
    apply: |_, plant| plant.sensor_rectified = true,
    ..Effect::USUAL
};
