//! The load over the place in SI units: the table `[position_load]` of `params.toml`, and the keys `position_load.…` of `truing params`.

use serde::{Deserialize, Serialize};
use servo::axis::{Axis, design::Design};
use servo::compensate::position_load::{Harmonic, Load, MOST_SHARE, PositionLoad, SHARE_BITS};
use servo::config::{Config, ConfigError};
use servo::control::Tuning;
use servo::store::AxisParameters;
use servo::units::ONE_TICK;
use std::f64::consts::TAU;

/// Phase that lag and delay may take at the bandwidth of loops made stiffer, rad. Chosen by judgement; not studied.
const MOST_PHASE: f32 = 0.3;
/// Of the bound of the chip, what a table takes, so that rounding does not cross it.
const OF_BOUND: f64 = 0.99;

/// A table in SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaceLoad {
    /// Is it to act?
    pub on: bool,
    /// May it?
    pub trusted: bool,
    /// Over the angle from the reference's zero, or over the counter as it is.
    pub absolute: bool,
    /// Counts after which it repeats itself; 0: there is none.
    pub period_counts: u32,
    /// V.
    pub constant_v: f64,
    /// At most four.
    pub sines: Vec<Sine>,
}

/// amplitude·sin(2π·cycles·count/period + phase).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sine {
    /// Whole ones of a period.
    pub cycles: u16,
    /// V, positive.
    pub amplitude_v: f64,
    /// rad.
    pub phase_rad: f64,
}

impl PlaceLoad {
    /// What is in force on an axis.
    pub fn of(table: &PositionLoad, config: &Config) -> Self {
        let volt = f64::from(config.supply_nominal_v) / f64::from(1 << 15);
        let sine = |term: servo::compensate::position_load::Term| Sine {
            cycles: term.cycles,
            amplitude_v: f64::from(term.amplitude) * volt,
            phase_rad: f64::from(term.phase) / f64::from(1 << 16) * TAU,
        };
        Self {
            on: table.is_on(),
            trusted: table.is_trusted(),
            absolute: table.is_absolute(),
            period_counts: table.period_counts(),
            constant_v: f64::from(table.constant()) * volt,
            sines: table.terms().map(sine).collect(),
        }
    }

    /// For the chip.
    pub fn build(&self, config: &Config) -> Result<PositionLoad, ConfigError> {
        let harmonic = |sine: &Sine| Harmonic {
            cycles: sine.cycles,
            amplitude_v: sine.amplitude_v as f32,
            phase_rad: sine.phase_rad as f32,
        };
        let harmonics: Vec<Harmonic> = self.sines.iter().map(harmonic).collect();
        let (period_counts, constant_v) = (self.period_counts, self.constant_v as f32);
        let load = Load { period_counts, constant_v, harmonics: &harmonics };
        Ok(load.build(&config.build()?)?.switched(self.on).trusted(self.trusted).absolute(self.absolute))
    }

    /// As much of it as the chip allows; which share.
    pub fn fit(&mut self, config: &Config) -> f64 {
        let volts = self.sines.iter().fold(self.constant_v.abs(), |sum, sine| sum + sine.amplitude_v);
        let share = (OF_BOUND * f64::from(MOST_SHARE) * f64::from(config.supply_nominal_v) / volts).min(1.0);
        self.constant_v *= share;
        self.sines.iter_mut().for_each(|sine| sine.amplitude_v *= share);
        share
    }
}

/// The loops of a set; `None`: there is no such axis.
pub fn designed(parameters: &AxisParameters) -> Option<Design> {
    let axis = Axis::from_parameters(parameters).ok()?;
    let mut state = axis.start();
    axis.adopt(&mut state, &parameters.estimates).ok()?;
    Some(*axis.design(&mut state))
}

/// The bandwidth of loops so stiff that they bear all of the table, or as far as lag and ticks allow; the present one if they do.
pub fn stiff_enough(of: &AxisParameters) -> f32 {
    let design = designed(of).unwrap_or_default();
    let follows =
        1.0 - f32::from(of.position_load.rest(design.loops.per_count())) / f32::from(1u16 << SHARE_BITS);
    let late_ticks =
        f32::from(of.config.pwm_delay_ticks) + 0.5 + f32::from(of.modelled.acting().lag) / ONE_TICK as f32;
    let most = (MOST_PHASE * design.motor.tau_ticks / late_ticks).min(Tuning::BANDWIDTHS.1);
    // The stiffness grows with the square.
    (of.tuning.bandwidth / follows.sqrt()).min(most).max(of.tuning.bandwidth)
}
