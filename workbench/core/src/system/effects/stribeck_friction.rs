//! Friction with a breakaway level above the kinetic one.

use super::*;

/// The effect.
pub static STRIBECK_FRICTION: Effect = Effect {
    name: "stribeck_friction",
    summary: "friction whose breakaway level lies above the kinetic level",
    equation: "T = −sign(ω)·(level + (breakaway − level)·exp(−(ω/ωs)²))",
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994",
    signature: "the trace of coulomb_friction, with an excess near standstill",
    confusable_with: &[&COULOMB_FRICTION],
    separated_by: "slow triangles through zero speed, many of them",
    parameters: &[
        Parameter::new("level_nm", "N m", Scale::Torque, 0.0, 0.8),
        Parameter::new("breakaway_nm", "N m", Scale::Torque, 0.0, 0.9),
        Parameter::new("stribeck_rad_s", "rad/s", Scale::Speed, 0.003, 0.4),
    ],
    starts: Starts::Grid(&[&[0.02, 0.04, 0.02], &[0.05, 0.1, 0.05], &[0.12, 0.2, 0.03], &[0.25, 0.4, 0.05]]),
    family: Family::DryFriction,
    domain: Domain::SlowMotion,
    form: Form::Rich,
    offered: Offered::Both(
        Steady::new(Role::Refinement, Shape::Own)
            // A steady state cannot tell the kinetic level from a dead zone.
            .forms(Forms::FromRest(&[Some(0.0), None, None])),
    ),
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.friction_pos += p[0];
        plant.friction_neg += p[0];
        plant.breakaway_extra += (p[1] - p[0]).max(0.0);
        plant.stribeck_speed = p[2];
    },
    ..Effect::USUAL
};
