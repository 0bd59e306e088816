//! Drag that grows with the square of the speed (fan, air, oil).

use super::{Axis, Effect, Family, Form, Parameter, Scale, Starts};
use crate::system::plant::physics::{Acts, Motion, TorqueLaw};

/// The effect.
pub const EFFECT: Effect = Effect {
    name: "quadratic_drag",
    summary: "drag that grows with the square of the speed",
    equation: "T = −drag·ω·|ω|",
    source: "Fox, McDonald: Introduction to Fluid Mechanics, 8th ed., 2011",
    signature: "missing torque odd and quadratic in speed",
    confusable_with: &["viscous_friction", "viscous_asymmetric"],
    separated_by: "staircase up to full speed",
    parameters: &[Parameter::new("drag_nms2", "N m s²/rad²", Scale::Drag, 0.0, 5.0)],
    starts: Starts::Grid(&[&[0.01], &[0.05], &[0.15], &[0.5]]),
    axis: Axis::Any,
    family: Family::Own("quadratic_drag"),
    form: Form::Plain,
    apply: |p, plant| {
        let parameters = [p[0], 0.0, 0.0];
        plant.torques.push(TorqueLaw {
            torque,
            parameters,
            acts: Acts::Motor,
        });
    },
};

fn torque(p: &[f64; 3], motion: &Motion) -> f64 {
    -p[0] * motion.omega * motion.omega.abs()
}
