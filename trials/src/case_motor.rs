//! The motor of a drawn case behind a servo: the truth's simulator with an encoder at its shaft.

use servo::config::Config;
use servo::optional::Optional;
use truing::device::motor::{Drive, Motor, Reading};
use truing::synthetic::cases::Case;
use truing::synthetic::reference_plant::{Encoder, Simulator};
use truing::text::input_error::InputError;

/// Error of the simulation in one step, relative to full scale.
const TOLERANCE: f64 = 1e-6;
/// Counts of the encoder, per turn: a common one of small motors.
const COUNTS_PER_REV: u32 = 4096;
/// Control rate, Hz: the fastest of these motors has a time constant of 60 ms.
const TICK_HZ: u32 = 1000;
/// The supply's converter reads up to this share of the nominal supply.
const HEADROOM: f64 = 1.6;

/// The motor in lock-step with a servo.
pub struct CaseMotor {
    simulator: Simulator,
    encoder: Encoder,
    reading_scale: f64,
}

impl CaseMotor {
    /// At rest. `None`: what hides in this case hides in a tacho, or behind an encoder at the load; a servo has neither.
    pub fn new(case: &Case, seed: u64) -> Option<Self> {
        let subject = &case.rig.subject;
        let unseen =
            subject.encoder_at_load || subject.motor.tacho.is_some() || subject.reading_offset != 0.0;
        (!unseen).then(|| Self {
            simulator: Simulator::new(subject.motor.clone(), TOLERANCE, seed),
            encoder: Encoder::new(COUNTS_PER_REV, 0.0, seed),
            reading_scale: subject.reading_scale,
        })
    }
}

impl Motor for CaseMotor {
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError> {
        let reading = self.simulator.step(f64::from(drive.duty), drive.bridge, f64::from(drive.tick_s));
        Ok(Reading {
            count: self.encoder.count(reading.theta * self.reading_scale) as i32,
            current_a: f32::NAN,
            supply_v: reading.supply as f32,
            flags: 0,
        })
    }
}

/// What the servo may know of the motor of a case: what is printed on it.
pub fn config(case: &Case) -> Config {
    let natural = &case.rig.natural;
    Config {
        supply_nominal_v: natural.volts as f32,
        counts_per_rev: COUNTS_PER_REV,
        rated_speed_rad_s: natural.speed as f32,
        gear_ratio: natural.gear_ratio as f32,
        tick_hz: TICK_HZ,
        time_constant_hint_s: Optional::NONE,
        vbus_v_per_lsb: (HEADROOM * natural.volts / 4095.0) as f32,
        current_a_per_lsb: (4.0 * natural.current / 4095.0) as f32,
        ..Config::EXAMPLE
    }
}
