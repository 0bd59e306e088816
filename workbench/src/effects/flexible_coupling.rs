//! Motor and load joined by a spring: two masses.

use super::{Axis, Effect, Family, Parameter, Scale, Starts};

/// The effect.
pub const EFFECT: Effect = Effect {
    name: "flexible_coupling",
    summary: "motor and load are joined by a spring",
    equation: "T_c = k·(θm − θl) + d·(ωm − ωl); the load has the given share of J",
    source: "Ellis: Control System Design Guide, 4th ed., 2012",
    signature: "ringing at one frequency after each step",
    confusable_with: &["backlash", "actuator_lag", "periodic_load"],
    separated_by: "chirp through the resonance, sampled five times faster than it",
    parameters: &[
        Parameter::new("stiffness_nm_per_rad", "N m/rad", Scale::Stiffness, 1.0, 1e6),
        Parameter::new("damping", "N m s/rad", Scale::Viscous, 0.0, 300.0),
        Parameter::new("load_share", "1", Scale::One, 0.02, 0.98),
    ],
    starts: Starts::Grid(&[
        &[30.0, 0.5, 0.5],
        &[300.0, 1.0, 0.5],
        &[3000.0, 2.0, 0.5],
        &[30000.0, 5.0, 0.5],
        &[300.0, 1.0, 0.15],
        &[3000.0, 2.0, 0.15],
        &[300.0, 1.0, 0.85],
        &[3000.0, 2.0, 0.85],
    ]),
    axis: Axis::Any,
    family: Family::Own("coupling"),
    apply: |p, plant| {
        plant.stiffness = p[0];
        plant.coupling_damping = p[1];
        plant.load_share = p[2];
    },
};
