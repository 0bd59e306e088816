//! The weight of an arm on the load.

use super::*;
use crate::system::plant::laws::{Acts, Law, TorqueLaw};

/// The effect.
pub static GRAVITY: Effect = Effect {
    name: "gravity",
    summary: "the weight of an arm",
    equation: "T = −(mgl/N)·sin(θ/N + phase), N = gear ratio",
    source: "Spong, Hutchinson, Vidyasagar: Robot Modeling and Control, 2006",
    signature: "missing torque is one sine per turn of the load",
    confusable_with: &[&CONSTANT_LOAD, &COGGING],
    separated_by: "slow motion over a full turn of the load",
    parameters: &[
        Parameter::new("mgl_nm", "N m", Scale::Torque, 0.0, 60.0),
        Parameter::new("phase_rad", "rad", Scale::One, -9.5, 9.5).meaning(Meaning::Phase),
    ],
    starts: Starts::GravityScan,
    domain: Domain::Turn,
    axis: Axis::Rotary,
    offered: Offered::Records(InTables::LeftOut),
    on_chip: OnChip::Known,
    apply: |p, plant| plant.torques.push(TorqueLaw::new(Law::Gravity, [p[0], p[1], 0.0], Acts::Load)),
    ..Effect::USUAL
};
