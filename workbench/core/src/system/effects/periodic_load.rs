//! A torque that is periodic in time.

use super::*;
use crate::system::plant::laws::{Acts, Law, TorqueLaw};

/// The effect.
pub static PERIODIC_LOAD: Effect = Effect {
    name: "periodic_load",
    summary: "a torque that is periodic in time",
    equation: "T = amplitude·sin(2π·f·t + phase)",
    source: "Ljung: System Identification, 2nd ed., 1999",
    signature: "one line in the spectrum of the missing torque, whatever the motion",
    confusable_with: &[&COGGING],
    separated_by: "the same run at another speed: a position effect changes its frequency, a load in time does not",
    parameters: &[
        Parameter::new("amplitude_nm", "N m", Scale::Torque, 0.0, 0.8),
        Parameter::new("frequency_hz", "Hz", Scale::Frequency, 0.001, 100.0).meaning(Meaning::Frequency),
        Parameter::new("phase_rad", "rad", Scale::One, -9.5, 9.5).meaning(Meaning::Phase),
    ],
    starts: Starts::TimeScan,
    form: Form::Rich,
    offered: Offered::Records(InTables::LeftOut),
    apply: |p, plant| plant.torques.push(TorqueLaw::new(Law::Periodic, [p[0], p[1], p[2]], Acts::Load)),
    ..Effect::USUAL
};
