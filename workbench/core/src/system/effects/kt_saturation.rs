//! The iron saturates: the torque constant falls with the current.

use super::*;

/// The effect.
pub static KT_SATURATION: Effect = Effect {
    name: "kt_saturation",
    summary: "the torque constant falls with the current",
    equation: "Kt(i) = Kt/(1 + (i/knee)²)",
    source: "Hendershot, Miller: Design of Brushless Permanent-Magnet Machines, 2010",
    signature: "missing torque only at high current, growing with its cube",
    confusable_with: &[&CURRENT_LIMIT, &SUPPLY_SAG],
    separated_by: "square reversals at full voltage; log the current: it is high although the torque is not",
    parameters: &[Parameter::new("knee_a", "A", Scale::Current, 0.1, 20.0)],
    starts: Starts::Grid(&[&[0.5], &[1.2], &[3.0]]),
    axis: Axis::Current,
    apply: |p, plant| plant.kt_knee_a = plant.kt_knee_a.min(p[0]),
    ..Effect::USUAL
};
