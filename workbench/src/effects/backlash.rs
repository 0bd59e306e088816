//! Free play between motor and load. `load_share` 0 is the massless play operator; above it the load's inertia
//! moves freely inside the gap and is caught inelastically at its ends.

use super::{Axis, Effect, Family, Parameter, Scale, Starts};

/// The effect.
pub const EFFECT: Effect = Effect {
    name: "backlash",
    summary: "free play between motor and load",
    equation: "θ_load stays within θ_motor ± gap/2; contact is inelastic",
    source: "Nordin, Gutman: Controlling mechanical systems with backlash, a survey, Automatica 38(10), 2002",
    signature: "residual only after reversals",
    confusable_with: &["transport_delay", "dead_zone", "flexible_coupling"],
    separated_by: "square reversals with small amplitude",
    parameters: &[
        Parameter::new("gap_rad", "rad", Scale::Angle, 0.0, 3.0),
        Parameter::new("load_share", "1", Scale::One, 0.0, 0.95).optional(0.0),
    ],
    starts: Starts::Grid(&[
        &[0.002, 0.0],
        &[0.006, 0.0],
        &[0.015, 0.0],
        &[0.03, 0.0],
        &[0.06, 0.0],
        &[0.12, 0.0],
        &[0.25, 0.0],
        &[0.55, 0.0],
        &[0.01, 0.3],
        &[0.04, 0.25],
        &[0.04, 0.5],
        &[0.15, 0.25],
        &[0.15, 0.5],
        &[0.4, 0.25],
        &[0.4, 0.5],
        &[0.9, 0.25],
        &[0.9, 0.5],
    ]),
    axis: Axis::Any,
    family: Family::Own("coupling"),
    apply: |p, plant| {
        plant.gap_rad += p[0];
        plant.load_share = plant.load_share.max(p[1]);
    },
};
