//! Constant (kinetic) friction, equal in both directions; below it the axis sticks.

use super::*;

/// The effect.
pub static COULOMB_FRICTION: Effect = Effect {
    name: "coulomb_friction",
    summary: "constant friction against the motion",
    equation: "T = −level·sign(ω); at rest it holds up to the level",
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994",
    signature: "missing torque −level·sign(ω), also while the bridge is open",
    confusable_with: &[&DEAD_ZONE, &STRIBECK_FRICTION, &VISCOUS_FRICTION, &VOLTAGE_DROP],
    separated_by: "square reversals or coast-downs: friction brakes an open bridge, a dead zone does not",
    parameters: &[Parameter::new("level_nm", "N m", Scale::Torque, 0.0, 0.8)],
    starts: Starts::Grid(&[&[0.005], &[0.02], &[0.05], &[0.12], &[0.25], &[0.5]]),
    family: Family::DryFriction,
    domain: Domain::Direction,
    offered: Offered::Both(Steady::new(Role::Rival, Shape::Edges)),
    relations: Relations { inseparable_from: &[&CONSTANT_LOAD], ..Relations::NONE },
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.friction_pos += p[0];
        plant.friction_neg += p[0];
    },
    ..Effect::USUAL
};
