//! Offset of the drive.

use super::*;

/// The effect.
pub static VOLTAGE_OFFSET: Effect = Effect {
    name: "voltage_offset",
    summary: "the drive adds a constant to the command",
    equation: "v = u + offset",
    source: "Ljung: System Identification, 2nd ed., 1999",
    signature: "constant missing torque while driven, none while the bridge is open",
    confusable_with: &[&CONSTANT_LOAD, &COULOMB_ASYMMETRIC, &DEAD_ZONE_ASYMMETRIC],
    separated_by: "coast-down with the bridge open, in both directions",
    parameters: &[Parameter::new("offset_v", "V", Scale::Input, -0.5, 0.5)],
    starts: Starts::Grid(&[&[-0.1], &[-0.02], &[0.02], &[0.1]]),
    offered: Offered::Both(Steady::new(Role::Representative, Shape::ZeroCrossing)),
    on_chip: OnChip::Known,
    apply: |p, plant| plant.drive_offset += p[0],
    ..Effect::USUAL
};
