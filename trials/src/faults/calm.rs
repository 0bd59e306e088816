//! Hard ordinary motion, for hours: nothing of it may be taken for a fault.
//!
//! Motions are drawn one after the other: sines, speeds, voltages, positions, reversals without a pause. Load steps of a
//! fifth of the dead zone, a supply that wanders by a tenth, and now and then an end stop, met as a gripper or a
//! referencing run meets it: with [`CONTACT`] dead zones at the terminals.

use super::trial::Trial;
use crate::families::{Family, Options, Plant, Seeds, Severity};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::axis::Command;
use servo::protect::{Fault, Settings};

/// Load steps, share of the mean dead zone.
const LOAD_STEP: f64 = 0.2;
/// The supply wanders between 1 − and 1 + this share …
const SUPPLY: f64 = 0.1;
/// … in steps of at most this share, drawn anew with every motion.
const SUPPLY_STEP: f64 = 0.05;
/// Terminal voltage against an end stop, dead zones: below the margin of protection by more than an identification errs.
pub const CONTACT: f64 = 1.3;
/// One motion in so many is a contact.
const CONTACT_EVERY: u32 = 12;

/// What hours of motion brought.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calm {
    /// Simulated, s.
    pub seconds: f64,
    /// … of which the shaft turned, s.
    pub moving_s: f64,
    /// Motions.
    pub motions: u32,
    /// Contacts with an end stop.
    pub contacts: u32,
    /// The first fault.
    pub fault: Fault,
    /// Motion under way at that moment.
    pub during: Option<Command>,
}

/// A harsh plant with load steps all through the run.
pub fn plant(family: Family, seeds: Seeds, tick_hz: u32, sensed: bool, seconds: f64) -> Plant {
    let options = Options { tick_hz, ..Options::default() };
    let mut plant = Plant::draw(family, Severity::Harsh, seeds, &options);
    plant.sensing.current = sensed;
    let mut rng = ChaCha8Rng::seed_from_u64(plant.seed ^ 0x10ad);
    let mean = 0.5 * (plant.truth.dead_zone_v[0] + plant.truth.dead_zone_v[1]);
    let torque = LOAD_STEP * mean * plant.motor.torque_constant / plant.motor.resistance_ohm;
    let mut time = start_s(family);
    while time < start_s(family) + 1.3 * seconds {
        time += rng.random_range(2.0..20.0) * plant.truth.time_constant_s;
        let level = f64::from(rng.random_range(0..2)) * torque;
        plant.motor.load.steps.push((time, level));
    }
    plant
}

/// Budget of the commissioning, ms.
pub fn budget_ms(family: Family) -> u32 {
    if family == Family::Paper { 20_000 } else { 5_000 }
}

/// The loads begin to step after the commissioning.
fn start_s(family: Family) -> f64 {
    1.5 * f64::from(budget_ms(family)) / 1e3
}

/// Moves for so many seconds, or until the first fault.
pub fn run(plant: &Plant, family: Family, seconds: f64) -> Calm {
    let mut trial = Trial::commissioned(plant, &Settings::default(), budget_ms(family));
    let mut rng = ChaCha8Rng::seed_from_u64(plant.seed ^ 0xca11);
    let mut calm = Calm { fault: trial.fault(), ..Calm::default() };
    let mut supply = 1.0;
    while calm.seconds < seconds && calm.fault == Fault::None {
        let step: f64 = rng.random_range(-SUPPLY_STEP..SUPPLY_STEP);
        supply = f64::clamp(supply + step, 1.0 - SUPPLY, 1.0 + SUPPLY);
        trial.world.set_supply(supply);
        let contact = rng.random_range(0..CONTACT_EVERY) == 0;
        if contact {
            touch(&mut trial, plant, &mut rng, &mut calm);
        } else {
            moving(&mut trial, plant, &mut rng, &mut calm);
        }
    }
    calm
}

fn moving(trial: &mut Trial, plant: &Plant, rng: &mut ChaCha8Rng, calm: &mut Calm) {
    let tau = plant.truth.time_constant_s;
    let (command, round_s) = trial.motion(rng);
    calm.motions += 1;
    if let Command::TrackSine { .. } = command {
        // It starts from rest only.
        pass(trial, plant, 6.0 * tau, Some(Command::Voltage(0.0)), calm);
    }
    pass(trial, plant, rng.random_range(0.1..1.2) * round_s, Some(command), calm);
}

/// Creeps against a stop, rests there and turns back.
fn touch(trial: &mut Trial, plant: &Plant, rng: &mut ChaCha8Rng, calm: &mut Calm) {
    let tau = plant.truth.time_constant_s;
    let side = rng.random_range(0..2usize);
    let sign = [1.0, -1.0][side];
    let volts = sign * (CONTACT - 1.0) * plant.truth.dead_zone_v[side];
    for (command, seconds) in [(0.0, 6.0), (volts, 4.0)] {
        let command = Command::Voltage(command as f32);
        pass(trial, plant, seconds * tau, Some(command), calm);
    }
    calm.contacts += 1;
    trial.world.block(sign);
    pass(trial, plant, rng.random_range(2.0..8.0) * tau, Some(Command::Voltage(volts as f32)), calm);
    pass(trial, plant, 2.0 * tau, Some(Command::Voltage(-volts as f32)), calm);
}

fn pass(trial: &mut Trial, plant: &Plant, seconds: f64, command: Option<Command>, calm: &mut Calm) {
    if calm.fault != Fault::None {
        return;
    }
    if let Some(command) = command {
        trial.may(command);
    }
    let tick_s = 1.0 / f64::from(plant.config.tick_hz);
    let count_rad_s = std::f64::consts::TAU / f64::from(plant.config.counts_per_rev);
    let full_rad_s = plant.truth.gain * plant.motor.drive.supply_v;
    // Turning: at least half a per cent of full speed, and a count in 50 ms.
    let least = (0.005 * full_rad_s).max(20.0 * count_rad_s);
    for _ in 0..(seconds / tick_s).round() as u64 {
        trial.tick();
        let omega = trial.world.reading().omega;
        calm.seconds += tick_s;
        calm.moving_s += if omega.abs() > least { tick_s } else { 0.0 };
    }
    calm.fault = trial.fault();
    if calm.fault != Fault::None {
        calm.during = command;
    }
}
