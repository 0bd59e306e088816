//! A constant external torque; positive drives the speed upwards.

use super::*;
use crate::system::plant::laws::{Acts, Law, TorqueLaw};

/// The effect.
pub static CONSTANT_LOAD: Effect = Effect {
    name: "constant_load",
    summary: "a constant external torque",
    equation: "T = +torque",
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994",
    signature: "constant missing torque, also while the bridge is open",
    confusable_with: &[&VOLTAGE_OFFSET, &COULOMB_ASYMMETRIC, &GRAVITY],
    separated_by: "coast-downs in both directions",
    parameters: &[Parameter::new("torque_nm", "N m", Scale::Torque, -0.8, 0.8)],
    starts: Starts::Grid(&[&[-0.1], &[-0.02], &[0.02], &[0.1]]),
    offered: Offered::Both(Steady::new(Role::Representative, Shape::ZeroCrossing)),
    on_chip: OnChip::Known,
    apply: |p, plant| plant.torques.push(TorqueLaw::new(Law::Constant, [p[0], 0.0, 0.0], Acts::Load)),
    ..Effect::USUAL
};
