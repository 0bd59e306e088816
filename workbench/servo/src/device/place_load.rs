//! The load over the place in SI units: the table `[position_load]` of `params.toml`, and the keys `position_load.…` of `truing params`.

use serde::{Deserialize, Serialize};
use servo::axis::Axis;
use servo::compensate::position_load::{Harmonic, Load, MOST_SHARE, MOST_SLOPE, PositionLoad};
use servo::config::{Config, ConfigError};
use servo::store::AxisParameters;
use std::f64::consts::TAU;

/// Of the bounds of the chip, what a table takes: gains that follow what is learned move them by some per cent.
const OF_BOUNDS: f64 = 0.9;

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
        let Self { period_counts, constant_v, .. } = *self;
        let load = Load { period_counts, constant_v: constant_v as f32, harmonics: &harmonics };
        Ok(load.build(&config.build()?)?.switched(self.on).trusted(self.trusted).absolute(self.absolute))
    }

    /// As much of the constant and of every sine, the slowest one first, as the chip allows beside the loops of these parameters; which
    /// share of each.
    pub fn fit(&mut self, beside: &AxisParameters) -> [Vec<f64>; 2] {
        let nominal = f64::from(beside.config.supply_nominal_v);
        let turn = TAU / f64::from(self.period_counts.max(1));
        let mut steepness = OF_BOUNDS * f64::from(MOST_SLOPE) * per_count(beside) * nominal;
        let most = OF_BOUNDS * f64::from(MOST_SHARE) * nominal;
        let constant = (most / self.constant_v.abs()).min(1.0);
        self.constant_v *= constant;
        let mut volts = most - self.constant_v.abs();
        let share = |sine: &mut Sine| {
            let steep = turn * f64::from(sine.cycles) * sine.amplitude_v;
            let share = (steepness / steep).min(volts / sine.amplitude_v).clamp(0.0, 1.0);
            sine.amplitude_v *= share;
            (steepness, volts) = (steepness - share * steep, volts - sine.amplitude_v);
            share
        };
        [vec![constant], self.sines.iter_mut().map(share).collect()]
    }
}

/// What the position loop of these parameters answers to a count, nominal supplies.
fn per_count(parameters: &AxisParameters) -> f64 {
    let Ok(axis) = Axis::from_parameters(parameters) else { return 0.0 };
    let mut state = axis.start();
    let adopted = axis.adopt(&mut state, &parameters.estimates);
    adopted.map_or(0.0, |()| f64::from(axis.design(&mut state).loops.per_count()))
}
