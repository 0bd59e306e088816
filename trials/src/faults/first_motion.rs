//! The first motion of a joint that nobody knows: how far does it go if the encoder is dead, or counts backwards?
//!
//! A fresh axis behind a gear, broken before it is switched on, is told to commission itself. What counts is the
//! farthest that the shaft gets from where it stood, in degrees of the joint, until it rests again.

use super::trial::Trial;
use super::world::Injury;
use crate::families::{Family, Options, Plant, Seeds, Severity};
use crate::tracking::quantile;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::axis::Command;
use servo::commission::Phase;
use servo::identify::estimate::Reason;
use servo::protect::{Fault, Settings};

/// Travel that is allowed, degrees of the joint.
pub const MOST_DEGREES: f64 = 5.0;

/// How one commissioning went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstMotion {
    /// Farthest from the start, degrees of the joint.
    pub degrees: f64,
    /// Was the shaft shaken, or did the ramp come first?
    pub shaken: bool,
    /// Why it was refused.
    pub refused: Option<Reason>,
    /// What protection found.
    pub fault: Fault,
}

/// A harsh plant behind a gear: encoders of fast motors sit on the rotor (ratios of 50 to 150 and of 20 to 60), those of
/// G3 and of the paper's motor on the joint itself.
pub fn plant(family: Family, seeds: Seeds, tick_hz: u32, sensed: bool) -> Plant {
    let options = Options { tick_hz, ..Options::default() };
    let mut plant = Plant::draw(family, Severity::Harsh, seeds, &options);
    let mut rng = ChaCha8Rng::seed_from_u64(plant.seed ^ 0x6ea2);
    plant.config.gear_ratio = match family {
        Family::G1 => rng.random_range(50.0..150.0),
        Family::G2 => rng.random_range(20.0..60.0),
        Family::G3 | Family::Paper => 1.0,
    };
    plant.sensing.current = sensed;
    plant
}

/// Commissions a fresh axis with this injury; the travel counts until it learns, or rests again after it was refused.
pub fn commission(plant: &Plant, injury: Injury, budget_ms: u32) -> FirstMotion {
    let mut trial = Trial::fresh(plant, &Settings::default());
    let start = trial.world.reading().theta;
    trial.world.injure(injury);
    trial.must(Command::Arm);
    trial.must(Command::Commission { budget_ms, seed: 1 });
    let tick_s = 1.0 / f64::from(plant.config.tick_hz);
    let coast = (8.0 * plant.truth.time_constant_s / tick_s) as u64;
    // The shaking comes on top of the budget: 5 of them last no longer.
    let mut left = (5.0 * f64::from(budget_ms) / 1e3 / tick_s) as u64;
    let (mut farthest, mut ended, mut shaken) = (0.0_f64, false, false);
    while left > 0 {
        let phase = trial.tick().record.phase;
        left -= 1;
        farthest = farthest.max((trial.world.reading().theta - start).abs());
        shaken |= phase == Phase::PulseTest as u8;
        if phase == Phase::Learn as u8 {
            break;
        }
        if phase == Phase::Refused as u8 && !ended {
            (ended, left) = (true, coast);
        }
    }
    let report = trial.report().commissioning;
    FirstMotion {
        degrees: (farthest / f64::from(plant.config.gear_ratio)).to_degrees(),
        shaken,
        refused: report.and_then(|report| report.refused),
        fault: trial.fault(),
    }
}

/// Travels of one kind.
#[derive(Clone, Debug, Default)]
pub struct Travels {
    degrees: Vec<f64>,
    refused: usize,
}

impl Travels {
    /// Head of the table.
    pub const HEAD: &'static str = "| family | first | current | broken | plants | refused | \
        within 5° | travel at the joint, °, median / p95 / worst |\n|---|---|---|---|---|---|---|---|";

    /// Adds one.
    pub fn note(&mut self, one: &FirstMotion) {
        self.degrees.push(one.degrees);
        self.refused += usize::from(one.refused.is_some() || one.fault != Fault::None);
    }

    /// One row.
    pub fn row(&self, key: &str) -> String {
        let at = |p| quantile(self.degrees.iter().copied(), p);
        let within = self.degrees.iter().filter(|&&degrees| degrees <= MOST_DEGREES).count();
        format!(
            "| {key} | {} | {} | {within} | {:.1} / {:.1} / {:.1} |",
            self.degrees.len(),
            self.refused,
            at(0.5),
            at(0.95),
            at(1.0),
        )
    }
}
