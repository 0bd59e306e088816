//! The motions by which an axis is judged: a sine at a fifth of full speed, and a slow crawl.

use serde::{Deserialize, Serialize};
use servo::config::Config;
use servo::link::protocol::Command;
use servo::record::Source;
use servo::store::AxisParameters;
use std::f64::consts::TAU;
use truing_core::text::input_error::InputError;
use truing_servo::device::feasible::Ability;
use truing_servo::device::place_load::designed;
use truing_servo::device::session::Profile;

/// Peak speed of the sine, and of the crawl, as a share of full speed.
const SPEEDS: [(&str, f64); 2] = [("sine", 0.2), ("crawl", 0.02)];
/// Periods of the sine and of the crawl.
const PERIODS: f64 = 1.5;
/// Angular frequency of the sine times the time constant: its voltage is then 1.6 times what its speed alone takes, which leaves room
/// for the rise over its first turn. At 2.5 voltage was short, and of 11 drawn motors 5 instead of 7 followed better.
const PHASE: f64 = 1.2;
/// Frequencies of the sine, Hz: below, a trial takes too long; above, a small motor hardly moves.
const SLOWEST_HZ: f64 = 0.5;
const FASTEST_HZ: f64 = 2.0;
/// No amplitude is smaller, counts: the encoder's steps would be most of the error.
const LEAST_COUNTS: f64 = 16.0;
/// Share of the way to the nearer end stop that is used.
const TRAVEL_SHARE: f64 = 0.8;

/// A sine in position around the place where the axis holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// `sine` or `crawl`.
    pub name: String,
    /// rad at the controlled shaft.
    pub amplitude_rad: f64,
    /// Hz.
    pub frequency_hz: f64,
    /// s.
    pub seconds: f64,
}

impl Motion {
    /// As the servo is asked for it.
    pub fn command(&self) -> Command {
        Command::TrackSine {
            amplitude_rad: self.amplitude_rad as f32,
            frequency_hz: self.frequency_hz as f32,
            duration_ms: (self.seconds * 1000.0).round() as u32,
        }
    }
}

/// What the axis can do with these numbers; `None`: its loops cannot be closed with them.
pub fn ability(parameters: &AxisParameters) -> Option<Ability> {
    let closes = designed(parameters)?.gain_source != Source::None;
    Ability::of(&parameters.config, &parameters.estimates).filter(|_| closes)
}

/// Motions that fit the travel and the voltage of all these sets.
pub fn motions(sets: [&AxisParameters; 2]) -> Result<Vec<Motion>, InputError> {
    let abilities: Vec<Ability> = sets.into_iter().filter_map(ability).collect();
    let config = &sets[0].config;
    let speed = |able: &Ability| (able.gain * able.available_v).min(able.fastest_rad_s);
    let full = abilities.iter().map(speed).reduce(f64::min).ok_or_else(|| InputError(OPEN.into()))?;
    let slow = abilities.iter().map(|able| able.time_constant_s).fold(0.0, f64::max);
    let frequency_hz = (PHASE / (TAU * slow)).clamp(SLOWEST_HZ, FASTEST_HZ);
    let way = farthest(config);
    let motion = |(name, share): (&str, f64)| {
        let wished = (share * full / (TAU * frequency_hz)).min(way);
        let amplitude = abilities.iter().fold(wished, |wished, able| fitted(able, wished, frequency_hz));
        Motion {
            name: name.into(),
            amplitude_rad: amplitude.max(LEAST_COUNTS * TAU / f64::from(config.counts_per_rev)).min(way),
            frequency_hz,
            seconds: PERIODS / frequency_hz,
        }
    };
    Ok(SPEEDS.into_iter().map(motion).collect())
}

const OPEN: &str = "the loops cannot be closed with what is known of the motor; commission it";

/// Largest amplitude between end stops, rad at the controlled shaft.
fn farthest(config: &Config) -> f64 {
    let way = |limit: f32| TRAVEL_SHARE * f64::from(limit * config.gear_ratio).abs();
    config.travel_limit_rad.map_or(f64::INFINITY, |[lower, upper]| way(lower).min(way(upper)))
}

/// The amplitude that fits the voltage.
fn fitted(able: &Ability, amplitude: f64, frequency_hz: f64) -> f64 {
    let (frequency_hz, seconds) = (frequency_hz as f32, (PERIODS / frequency_hz) as f32);
    let profile = Profile::Sine { amplitude_rad: amplitude as f32, frequency_hz, seconds };
    match able.shortfall(&profile).map(|short| short.fit(&profile)) {
        Some(Profile::Sine { amplitude_rad, .. }) => f64::from(amplitude_rad),
        _ => amplitude,
    }
}
