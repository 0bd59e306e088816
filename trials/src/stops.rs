//! Plants between two end stops, for referencing.

use crate::families::{Family, Options, Plant, Seeds, Severity};
use std::f64::consts::TAU;
use truing::synthetic::reference_plant::Oddity;

/// Where the stops are, turns of the controlled shaft to either side of power-up.
pub const STOP_TURNS: f64 = 2.0;

/// A plant between two stops that give way by three counts at stall torque.
pub fn between_stops(family: Family, seed: u32) -> Plant {
    let options = Options { tick_hz: 10_000, ..Options::default() };
    let mut plant = Plant::draw(family, Severity::Harsh, Seeds::Design(seed), &options);
    let motor = &mut plant.motor;
    let stall = motor.torque_constant * motor.drive.supply_v / motor.resistance_ohm;
    let count = TAU / f64::from(plant.config.counts_per_rev);
    motor.load.oddity =
        Some(Oddity::EndStop { stiffness: stall / (3.0 * count), theta0_rad: STOP_TURNS * TAU });
    plant
}
