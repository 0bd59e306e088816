//! Constant friction that differs between the two directions.

use super::*;

/// The effect.
pub static COULOMB_ASYMMETRIC: Effect = Effect {
    name: "coulomb_asymmetric",
    summary: "constant friction, different in the two directions",
    equation: "T = −pos for ω > 0, +neg for ω < 0",
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994; measured: Janot, Gautier, Brunot, EMPS reference models, 2019",
    signature: "the trace of coulomb_friction, with different heights for the two directions; equals coulomb_friction with constant_load while it slides",
    confusable_with: &[&CONSTANT_LOAD, &COULOMB_FRICTION, &VOLTAGE_OFFSET],
    separated_by: "rest: friction holds the axis, a constant load moves it",
    parameters: &[
        Parameter::new("pos_nm", "N m", Scale::Torque, 0.0, 0.8),
        Parameter::new("neg_nm", "N m", Scale::Torque, 0.0, 0.8),
    ],
    starts: Starts::Grid(&[&[0.01, 0.02], &[0.02, 0.01], &[0.05, 0.08], &[0.08, 0.05], &[0.2, 0.25]]),
    family: Family::DryFriction,
    domain: Domain::Direction,
    form: Form::Rich,
    offered: Offered::Both(Steady::new(Role::Rival, Shape::Edges).needs(Needs::Reversal)),
    relations: Relations {
        inseparable_from: &[&CONSTANT_LOAD],
        ..Relations::uneven(&COULOMB_FRICTION, &SHIFTS)
    },
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.friction_pos += p[0];
        plant.friction_neg += p[1];
    },
    ..Effect::USUAL
};
