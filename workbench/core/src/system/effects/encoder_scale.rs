//! The reading has a wrong scale (counts per turn, gear ratio, tacho constant).

use super::*;

/// The effect.
pub static ENCODER_SCALE: Effect = Effect {
    name: "encoder_scale",
    summary: "the reading has a wrong scale",
    equation: "reading = ratio·ω, logged position = ratio·θ",
    source: "Doebelin: Measurement Systems, 5th ed., 2003",
    signature: "residual proportional to the speed",
    confusable_with: &[&DRIVE_GAIN, &MOTOR_GAIN],
    separated_by: "log the current, or turn the shaft by hand through a known angle",
    parameters: &[Parameter::new("ratio", "1", Scale::One, 0.2, 5.0).meaning(Meaning::Ratio)],
    starts: Starts::Grid(&[&[0.6], &[0.8], &[0.95], &[1.05], &[1.2], &[1.6]]),
    form: Form::Absorbed,
    offered: Offered::Both(Steady::new(Role::Rival, Shape::Slope)),
    relations: Relations { multiplies: Some(Multiplies::Chain("encoder_scale")), ..Relations::NONE },
    on_chip: OnChip::Known,
    apply: |p, plant| plant.sensor_scale *= p[0],
    ..Effect::USUAL
};
