//! Gain error of the drive or of the supply.

use super::*;

/// The effect.
pub static DRIVE_GAIN: Effect = Effect {
    name: "drive_gain",
    summary: "the drive gives more or less than the command says",
    equation: "v = ratio·u",
    source: "Ljung: System Identification, 2nd ed., 1999",
    signature: "missing torque linear in u",
    confusable_with: &[&ENCODER_SCALE, &MOTOR_GAIN, &SUPPLY_SAG],
    separated_by: "log the current, or know the counts per turn: speed alone cannot tell it from the sensor's scale",
    parameters: &[Parameter::new("ratio", "1", Scale::One, 0.2, 5.0).meaning(Meaning::Ratio)],
    starts: Starts::Grid(&[&[0.6], &[0.8], &[0.95], &[1.05], &[1.2], &[1.6]]),
    form: Form::Absorbed,
    offered: Offered::Both(Steady::new(Role::Representative, Shape::Slope)),
    relations: Relations { multiplies: Some(Multiplies::Chain("drive_gain")), ..Relations::NONE },
    on_chip: OnChip::Known,
    apply: |p, plant| plant.drive_gain *= p[0],
    ..Effect::USUAL
};
