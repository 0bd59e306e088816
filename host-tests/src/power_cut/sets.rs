//! Sets of parameters that differ, and what an image of the past would have stored.

use serde::Serialize;
use servo::config::Config;
use servo::control::Tuning;
use servo::identify::estimate::{Estimate, Estimates, Mechanism, Reason, Standing};
use servo::protect::Settings;
use servo::store::{AxisParameters, StoredParameters};

/// A set that is unlike every other number's set; `number % 4` axes more than one, sometimes one of them empty.
pub fn set(number: u32) -> StoredParameters {
    StoredParameters {
        axes: (0..=number % 4)
            .map(|axis| (number % 7 != 5 || axis % 2 == 1).then(|| parameters(number, axis)))
            .collect(),
    }
}

fn parameters(number: u32, axis: u32) -> AxisParameters {
    AxisParameters {
        config: config(number, axis),
        estimates: estimates(number as i32),
        tuning: Tuning {
            bandwidth: 0.6 + number as f32 / 1000.0,
            integral: !number.is_multiple_of(3),
        },
        compensation: number.is_multiple_of(2),
        protection: Settings::default(),
    }
}

/// A configuration within all ranges.
pub fn config(number: u32, axis: u32) -> Config {
    Config {
        supply_nominal_v: 12.0,
        counts_per_rev: 4096 + number,
        rated_speed_rad_s: 150.0 + axis as f32,
        tick_hz: 10_000,
        time_constant_hint_s: Some(0.04),
        gear_ratio: 30.0,
        travel_limit_rad: Some([-1.5, 1.5]),
        current_limit_a: Some(3.0),
        energy_limit_j: None,
        speed_limit_rad_s: Some(200.0),
        pwm_delay_ticks: 1,
        pwm_full_scale: 8400,
        vbus_v_per_lsb: 0.01,
        current_a_per_lsb: 0.005,
    }
}

fn estimates(number: i32) -> Estimates {
    let trusted = |value| Estimate {
        value: value + number,
        u95: 900,
        standing: Standing::Trusted,
    };
    Estimates {
        dead_zone: [trusted(104_857), trusted(95_000)],
        saturation: [trusted(700_000), Estimate::missing(Reason::NotSeen)],
        gain_skew: 0,
        gain: trusted(1_050_000),
        time_constant: trusted(1_638_400),
        mechanism: Mechanism::Friction,
    }
}

/// The set as layout 2 knew it: without empty axes.
#[derive(Serialize)]
pub struct SetLayout2 {
    axes: Vec<(Config, Estimates, Tuning, bool)>,
}

impl SetLayout2 {
    /// What an older image would have stored of this set, which has no empty axis.
    pub fn of(set: &StoredParameters) -> Self {
        SetLayout2 {
            axes: set
                .axes
                .iter()
                .flatten()
                .map(|axis| (axis.config, axis.estimates, axis.tuning, axis.compensation))
                .collect(),
        }
    }
}

/// The set as layout 1 knew it: without tuning.
#[derive(Serialize)]
pub struct SetLayout1 {
    axes: Vec<(Config, Estimates)>,
}

impl SetLayout1 {
    /// What an older image would have stored of this set.
    pub fn of(set: &StoredParameters) -> Self {
        SetLayout1 {
            axes: set
                .axes
                .iter()
                .flatten()
                .map(|axis| (axis.config, axis.estimates))
                .collect(),
        }
    }
}

/// What must be read from it: the same axes with the tuning that a new image gives them.
pub fn migrated(set: &StoredParameters) -> StoredParameters {
    let mut set = set.clone();
    for axis in set.axes.iter_mut().flatten() {
        axis.tuning = Tuning::default();
        axis.compensation = true;
    }
    set
}
