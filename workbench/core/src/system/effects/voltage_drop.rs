//! Constant drop of brushes and bridge in the direction of the current.

use super::*;

/// The effect.
pub static VOLTAGE_DROP: Effect = Effect {
    name: "voltage_drop",
    summary: "brushes or bridge drop a constant voltage",
    equation: "v = u − drop·sign(i)",
    source: "Krishnan: Electric Motor Drives, 2001",
    signature: "missing torque −sign(i)·Kt·drop/R",
    confusable_with: &[&DEAD_ZONE, &COULOMB_FRICTION],
    separated_by: "coast-down (no current, no drop) and regenerative braking, where current and speed have opposite signs",
    parameters: &[Parameter::new("drop_v", "V", Scale::Input, 0.0, 0.5)],
    starts: Starts::Grid(&[&[0.02], &[0.06], &[0.15], &[0.3]]),
    axis: Axis::BackEmf,
    domain: Domain::Current,
    offered: Offered::Both(Steady::new(Role::Rival, Shape::Edges)),
    on_chip: OnChip::Known,
    apply: |p, plant| plant.drop_v += p[0],
    ..Effect::USUAL
};
