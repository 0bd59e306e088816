//! Torque that is periodic in the motor's position (slots, commutation, gear teeth).

use super::*;
use crate::system::plant::physics::{Acts, Motion, TorqueLaw};

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
    axis: Axis::Any,
    family: Family::Own,
    form: Form::RichWithoutPosition,
    offered: Offered::Records(InTables::LeftOut),
    relations: Relations::NONE,
    on_chip: OnChip::Unknown,
    apply: |p, plant| {
        let parameters = [p[0], p[1], p[2]];
        plant.torques.push(TorqueLaw { torque, parameters, acts: Acts::Motor });
    },
};

/// The mean over the step, which does not alias when a step spans much of a period.
fn torque(p: &[f64; 3], motion: &Motion) -> f64 {
    let middle = 0.5 * (motion.theta + motion.theta_next);
    let half = 0.5 * p[1] * (motion.theta_next - motion.theta);
    let sinc = if half.abs() < 1e-3 { 1.0 - half * half / 6.0 } else { half.sin() / half };
    -p[0] * sinc * (p[1] * middle + p[2]).sin()
}
