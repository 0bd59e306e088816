//! A spring that pulls the shaft back to a rest angle: throttle bodies, gripper joints, valves with spring return.

use super::*;
use crate::system::plant::laws::{Acts, Law, TorqueLaw};

/// The return spring. Its angle is that of the encoder's shaft, counted as the log counts its position, or from the start of
/// each run if the log holds none.
pub static TORSIONAL_SPRING: Effect = Effect {
    name: "torsional_spring",
    summary: "a spring pulls the shaft back to a rest angle",
    equation: "T = −k·(θ − rest) − cubic·(θ − rest)³",
    source: "Deur, Pavković, Perić, Jansz, Hrovat: IEEE Trans. Industry Applications 40(3), 2004 (throttle body); cubic part: Kovacic, Brennan: The Duffing Equation, 2011",
    signature: "missing torque is a straight or a progressive function of the position, also while the bridge is open",
    confusable_with: &[&CONSTANT_LOAD, &GRAVITY, &COGGING],
    separated_by: "open the bridge at several angles on either side of the rest angle: a spring pulls back more the further away it is, a constant load pulls the same way everywhere, gravity repeats itself every turn",
    // With k = 1 the spring holds the stalled motor at the angle that full speed covers in one time constant.
    parameters: &[
        Parameter::new("stiffness_nm_per_rad", "N m/rad", Scale::TorquePerAngle(1), 0.0, 100.0),
        Parameter::new("rest_rad", "rad", Scale::Angle, -100.0, 100.0),
        Parameter::new("cubic_nm_per_rad3", "N m/rad³", Scale::TorquePerAngle(3), 0.0, 100.0)
            .optional(0.0)
            .unknown_on_chip(),
    ],
    starts: Starts::Grid(&[
        &[0.003, 0.0, 0.0],
        &[0.02, 0.0, 0.0],
        &[0.1, 0.0, 0.0],
        &[0.5, 0.0, 0.0],
        &[3.0, 0.0, 0.0],
        &[0.001, 0.0, 1e-5],
        &[0.01, 0.0, 1e-3],
        &[0.05, 0.0, 0.1],
    ]),
    // Within a part of a turn the weight of an arm pulls back as a spring does, and it is met far more often.
    form: Form::Rich,
    // The motor does not turn on against a spring: no speed settles.
    offered: Offered::Records(InTables::LeftOut),
    relations: Relations { inseparable_from: &[&CONSTANT_LOAD], ..Relations::NONE },
    on_chip: OnChip::Known,
    apply: |p, plant| plant.torques.push(TorqueLaw::new(Law::Spring, [p[0], p[1], p[2]], Acts::Load)),
    ..Effect::USUAL
};
