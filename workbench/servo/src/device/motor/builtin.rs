//! Our plant as a motor: a model file, hidden effects allowed, with the sensors' imperfections.

use super::{Drive, Motor, Reading};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Uniform};
use servo::config::Config;
use std::f64::consts::TAU;
use std::path::Path;
use truing_core::system::plant;
use truing_core::text::input_error::InputError;
use truing_files::model::{self, Model};

/// Noise of the supply reading, relative, one sigma: a resistive divider and a 12-bit converter.
const SUPPLY_NOISE: f64 = 0.003;

/// The plant, its encoder and its supply sensor.
pub struct Builtin {
    plant: plant::Motor,
    counts_per_rev: f64,
    /// Where the shaft stands between two edges of the encoder at the start, counts.
    phase: f64,
    noise: Normal<f64>,
    random: ChaCha8Rng,
    current_sensed: bool,
    supply_measured: bool,
}

impl Builtin {
    /// From a model file; it must agree with the configuration on encoder and supply.
    pub fn open(path: &Path, config: &Config, seed: u64) -> Result<Self, InputError> {
        let model = model::read(path)?;
        check(path.display(), &model, config)?;
        Ok(Self::new(&model, config, seed))
    }

    /// From a model. `seed` draws the supply's noise and the encoder's phase.
    pub fn new(model: &Model, config: &Config, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut physics = model.physics();
        if !physics.supply_v.is_finite() {
            physics.supply_v = f64::from(config.supply_nominal_v);
        }
        let counts_per_rev = f64::from(config.counts_per_rev);
        let phase = Uniform::new(0.0, 1.0).map_or(0.5, |unit| unit.sample(&mut random));
        Self {
            plant: plant::Motor::new(physics, counts_per_rev),
            counts_per_rev,
            phase,
            noise: Normal::new(1.0, SUPPLY_NOISE).expect("a positive deviation"),
            random,
            current_sensed: model.sensors.current_logged == Some(true),
            supply_measured: model.sensors.vbus_logged != Some(false),
        }
    }
}

/// The chip is told less than the motor is, but not something else.
pub fn check(source: impl std::fmt::Display, model: &Model, config: &Config) -> Result<(), InputError> {
    if let Some(encoder) = model.encoder
        && encoder.counts_per_rev != f64::from(config.counts_per_rev)
    {
        let (motor, axis) = (encoder.counts_per_rev, config.counts_per_rev);
        let what = format!("encoder.counts_per_rev is {motor}, the axis file says {axis}; make them equal");
        return Err(InputError::file(source, what));
    }
    Ok(())
}

impl Motor for Builtin {
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError> {
        // Frame 0 asks for the initial state: an open bridge at rest changes nothing.
        let answer = self.plant.step_duty(f64::from(drive.duty), drive.bridge, f64::from(drive.tick_s));
        let counts = answer.theta_rad / TAU * self.counts_per_rev + self.phase;
        let supply = answer.supply_v * self.noise.sample(&mut self.random);
        Ok(Reading {
            count: counts.floor() as i64 as i32,
            current_a: if self.current_sensed { answer.current_a as f32 } else { f32::NAN },
            supply_v: if self.supply_measured { supply as f32 } else { f32::NAN },
            flags: 0,
        })
    }
}
