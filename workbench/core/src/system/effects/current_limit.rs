//! Current limit of the drive.

use super::*;

/// The effect.
pub static CURRENT_LIMIT: Effect = Effect {
    name: "current_limit",
    summary: "the drive limits the current",
    equation: "|i| ≤ limit",
    source: "Krishnan: Electric Motor Drives, 2001",
    signature: "missing torque only where the model's current is high: starts and reversals",
    confusable_with: &[&VOLTAGE_SATURATION, &INERTIA, &KT_SATURATION],
    separated_by: "square reversals at full voltage; log the current",
    parameters: &[Parameter::new("limit_a", "A", Scale::Current, 0.02, 2.5)],
    starts: Starts::Quantiles(Signal::Current, &[]),
    axis: Axis::Current,
    offered: Offered::Both(Steady::new(Role::Rival, Shape::Limit)),
    apply: |p, plant| plant.current_limit = plant.current_limit.min(p[0]),
    ..Effect::USUAL
};
