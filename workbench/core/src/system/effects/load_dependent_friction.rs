//! Friction of a gear: it grows with the torque that passes through it.

use super::*;

/// The effect.
pub static LOAD_DEPENDENT_FRICTION: Effect = Effect {
    name: "load_dependent_friction",
    summary: "friction that grows with the torque through the gear",
    equation: "T = −sign(ω)·(level + a·|T_motor| + c·|T_load|)",
    source: "Duclusaud et al., Extended Friction Models for the Physics Simulation of Servo Actuators, arXiv:2410.08650, 2024",
    signature: "missing torque against the motion, growing with the current or with the load",
    confusable_with: &[&COULOMB_FRICTION, &KT_SATURATION, &DRIVE_GAIN],
    separated_by: "the same speed with different loads or accelerations",
    parameters: &[
        Parameter::new("level_nm", "N m", Scale::Torque, 0.0, 0.8),
        Parameter::new("per_motor_torque", "1", Scale::One, 0.0, 0.9),
        Parameter::new("per_load_torque", "1", Scale::One, 0.0, 0.9).unknown_on_chip(),
    ],
    starts: Starts::Grid(&[&[0.01, 0.05, 0.02], &[0.03, 0.15, 0.1], &[0.08, 0.3, 0.05]]),
    family: Family::DryFriction,
    form: Form::Rich,
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.friction_pos += p[0];
        plant.friction_neg += p[0];
        plant.friction_per_motor += p[1];
        plant.friction_per_load += p[2];
    },
    ..Effect::USUAL
};
