//! Offset of the drive.

use super::{Axis, Effect, Family, Form, Parameter, Scale, Starts};

/// The effect.
pub const EFFECT: Effect = Effect {
    name: "voltage_offset",
    summary: "the drive adds a constant to the command",
    equation: "v = u + offset",
    source: "Ljung: System Identification, 2nd ed., 1999",
    signature: "constant missing torque while driven, none while the bridge is open",
    confusable_with: &["constant_load", "coulomb_asymmetric", "dead_zone_asymmetric"],
    separated_by: "coast-down with the bridge open, in both directions",
    parameters: &[Parameter::new("offset_v", "V", Scale::Input, -0.5, 0.5)],
    starts: Starts::Grid(&[&[-0.1], &[-0.02], &[0.02], &[0.1]]),
    axis: Axis::Any,
    family: Family::Own("voltage_offset"),
    form: Form::Plain,
    apply: |p, plant| plant.drive_offset += p[0],
};
