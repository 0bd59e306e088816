//! Constant (kinetic) friction, equal in both directions; below it the axis sticks.

use super::{Axis, Effect, Family, Form, Parameter, Scale, Starts};

/// The effect.
pub const EFFECT: Effect = Effect {
    name: "coulomb_friction",
    summary: "constant friction against the motion",
    equation: "T = −level·sign(ω); at rest it holds up to the level",
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994",
    signature: "missing torque −level·sign(ω), also while the bridge is open",
    confusable_with: &[
        "dead_zone",
        "stribeck_friction",
        "viscous_friction",
        "voltage_drop",
    ],
    separated_by: "square reversals or coast-downs: friction brakes an open bridge, a dead zone does not",
    parameters: &[Parameter::new("level_nm", "N m", Scale::Torque, 0.0, 0.8)],
    starts: Starts::Grid(&[&[0.005], &[0.02], &[0.05], &[0.12], &[0.25], &[0.5]]),
    axis: Axis::Any,
    family: Family::DryFriction,
    form: Form::Plain,
    apply: |p, plant| {
        plant.friction_pos += p[0];
        plant.friction_neg += p[0];
    },
};
