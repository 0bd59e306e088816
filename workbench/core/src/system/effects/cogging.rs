//! Torque that is periodic in the motor's position (slots, commutation, gear teeth).

use super::*;
use crate::system::plant::laws::{Acts, Law, TorqueLaw};

/// The effect.
pub static COGGING: Effect = Effect {
    name: "cogging",
    summary: "a torque that is periodic in the position",
    equation: "T = −amplitude·sin(n·θ + phase)",
    source: "Holtz, Springob: IEEE Trans. Industrial Electronics 43(2), 1996",
    signature: "one harmonic of the position explains the missing torque",
    confusable_with: &[&GRAVITY, &PERIODIC_LOAD],
    separated_by: "crawl over more than one turn at less than one period per sample",
    parameters: &[
        Parameter::new("amplitude_nm", "N m", Scale::Torque, 0.0, 0.8),
        Parameter::new("periods_per_rev", "1", Scale::One, 0.2, 2000.0).meaning(Meaning::PeriodsPerTurn),
        Parameter::new("phase_rad", "rad", Scale::One, -9.5, 9.5).meaning(Meaning::Phase),
    ],
    starts: Starts::PositionScan,
    domain: Domain::Turn,
    form: Form::RichWithoutPosition,
    offered: Offered::Records(InTables::LeftOut),
    on_chip: OnChip::Known,
    apply: |p, plant| plant.torques.push(TorqueLaw::new(Law::Cogging, [p[0], p[1], p[2]], Acts::Motor)),
    ..Effect::USUAL
};
