//! Drag that grows with the square of the speed (fan, air, oil).

use super::*;
use crate::system::plant::laws::{Acts, Law, TorqueLaw};

/// The effect.
pub static QUADRATIC_DRAG: Effect = Effect {
    name: "quadratic_drag",
    summary: "drag that grows with the square of the speed",
    equation: "T = −drag·ω·|ω|",
    source: "Fox, McDonald: Introduction to Fluid Mechanics, 8th ed., 2011",
    signature: "missing torque odd and quadratic in speed",
    confusable_with: &[&VISCOUS_FRICTION, &VISCOUS_ASYMMETRIC],
    separated_by: "staircase up to full speed",
    parameters: &[Parameter::new("drag_nms2", "N m s²/rad²", Scale::Drag, 0.0, 5.0)],
    starts: Starts::Grid(&[&[0.01], &[0.05], &[0.15], &[0.5]]),
    domain: Domain::FastMotion,
    offered: Offered::Both(Steady::new(Role::Representative, Shape::Bend)),
    on_chip: OnChip::Known,
    apply: |p, plant| plant.torques.push(TorqueLaw::new(Law::Drag, [p[0], 0.0, 0.0], Acts::Motor)),
    ..Effect::USUAL
};
