//! Sets of parameters that differ, and what an image of the past would have stored.

use serde::Serialize;
use servo::compensate::modelled::{DryFriction, Modelled, OverSpeed};
use servo::compensate::position_load::{Harmonic, Load, PositionLoad};
use servo::config::Config;
use servo::control::Tuning;
use servo::identify::estimate::{Estimate, Estimates, Mechanism, Reason, Standing};
use servo::optional::Optional;
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
        tuning: Tuning { bandwidth: 0.6 + number as f32 / 1000.0, integral: !number.is_multiple_of(3) },
        compensation: number.is_multiple_of(2),
        protection: Settings::default(),
        position_load: position_load(number),
        modelled: Modelled {
            lag: 21 + (number % 500) as u16,
            load_friction: 1_000 * (1 + number % 3) as u16,
            over_speed: OverSpeed { skew: 100 - (number % 7) as i16, drag: 0 },
            dry: DryFriction { share: 30, ..DryFriction::default() },
            play: 0,
            doubted: 1 + (number % 3) as u8,
        },
    }
}

/// None for some, and for four axes: a record has no room for so many tables.
fn position_load(number: u32) -> PositionLoad {
    let sine =
        |cycles| Harmonic { cycles, amplitude_v: 0.25 + (number % 1000) as f32 / 1000.0, phase_rad: 1.5 };
    let table =
        Load { period_counts: 4096 + number, constant_v: -0.5, harmonics: &[sine(1), sine(7), sine(12)] };
    let scale = config(number, 0).build().expect("within its ranges");
    if number % 5 == 1 || number % 4 == 3 {
        PositionLoad::default()
    } else {
        table.build(&scale).expect("small").absolute(true)
    }
}

/// A configuration within all ranges.
pub fn config(number: u32, axis: u32) -> Config {
    Config {
        supply_nominal_v: 12.0,
        counts_per_rev: 4096 + number,
        rated_speed_rad_s: 150.0 + axis as f32,
        tick_hz: 10_000,
        time_constant_hint_s: Optional::new(0.04),
        gear_ratio: 30.0,
        travel_limit_rad: Some([-1.5, 1.5]),
        current_limit_a: Optional::new(3.0),
        speed_limit_rad_s: Optional::new(200.0),
        pwm_delay_ticks: 1,
        pwm_full_scale: 8400,
        vbus_v_per_lsb: 0.01,
        current_a_per_lsb: 0.005,
        supply_low_v: Optional::new(9.0),
        acceleration_limit_rad_s2: Optional::new(2000.0 + number as f32),
        voltage_limit_v: Optional::new(10.5),
        ..Config::EXAMPLE
    }
}

fn estimates(number: i32) -> Estimates {
    let trusted = |value| Estimate { value: value + number, u95: 900, standing: Standing::Trusted };
    Estimates {
        dead_zone: [trusted(104_857), trusted(95_000)],
        saturation: [trusted(700_000), Estimate::missing(Reason::NotSeen)],
        gain_skew: 0,
        gain: trusted(1_050_000),
        time_constant: trusted(1_638_400),
        mechanism: Mechanism::Friction,
    }
}

type Axis5 = (Config, Estimates, Tuning, bool, Settings, PositionLoad);

/// The set as layout 5 knew it.
#[derive(Serialize)]
pub struct SetLayout5 {
    axes: Vec<Option<Axis5>>,
}

impl SetLayout5 {
    /// What an older image would have stored of this set.
    pub fn of(set: &StoredParameters) -> Self {
        let axis = |it: &AxisParameters| {
            (it.config, it.estimates, it.tuning, it.compensation, it.protection, it.position_load)
        };
        let axes = set.axes.iter().map(|entry| entry.as_ref().map(axis));
        SetLayout5 { axes: axes.collect() }
    }
}

/// What must be read from it when it was stored in layout 4 or 5: without what a model tells.
pub fn untold(set: &StoredParameters) -> StoredParameters {
    let mut set = set.clone();
    set.axes.iter_mut().flatten().for_each(|axis| axis.modelled = Modelled::default());
    set
}

/// The configuration as layouts 1 to 3 knew it, field by field.
type Config3 = (
    f32,
    u32,
    f32,
    u32,
    Option<f32>,
    f32,
    Option<[f32; 2]>,
    Option<f32>,
    Option<f32>,
    Option<f32>,
    u8,
    u16,
    f32,
    f32,
);

fn config_3(config: &Config) -> Config3 {
    (
        config.supply_nominal_v,
        config.counts_per_rev,
        config.rated_speed_rad_s,
        config.tick_hz,
        config.time_constant_hint_s.get(),
        config.gear_ratio,
        config.travel_limit_rad,
        config.current_limit_a.get(),
        config.energy_limit_j.get(),
        config.speed_limit_rad_s.get(),
        config.pwm_delay_ticks,
        config.pwm_full_scale,
        config.vbus_v_per_lsb,
        config.current_a_per_lsb,
    )
}

type Axis3 = (Config3, Estimates, Tuning, bool, Settings);

/// The set as layout 3 knew it.
#[derive(Serialize)]
pub struct SetLayout3 {
    axes: Vec<Option<Axis3>>,
}

impl SetLayout3 {
    /// What an older image would have stored of this set.
    pub fn of(set: &StoredParameters) -> Self {
        let axis = |axis: &AxisParameters| {
            let config = config_3(&axis.config);
            (config, axis.estimates, axis.tuning, axis.compensation, axis.protection)
        };
        let axes = set.axes.iter().map(|entry| entry.as_ref().map(axis));
        SetLayout3 { axes: axes.collect() }
    }
}

/// The set as layout 2 knew it: without empty axes.
#[derive(Serialize)]
pub struct SetLayout2 {
    axes: Vec<(Config3, Estimates, Tuning, bool)>,
}

impl SetLayout2 {
    /// What an older image would have stored of this set, which has no empty axis.
    pub fn of(set: &StoredParameters) -> Self {
        let axes = set.axes.iter().flatten();
        let axes = axes.map(|axis| {
            let config = config_3(&axis.config);
            (config, axis.estimates, axis.tuning, axis.compensation)
        });
        SetLayout2 { axes: axes.collect() }
    }
}

/// The set as layout 1 knew it: without tuning.
#[derive(Serialize)]
pub struct SetLayout1 {
    axes: Vec<(Config3, Estimates)>,
}

impl SetLayout1 {
    /// What an older image would have stored of this set.
    pub fn of(set: &StoredParameters) -> Self {
        let axes = set.axes.iter().flatten();
        let axes = axes.map(|axis| (config_3(&axis.config), axis.estimates));
        SetLayout1 { axes: axes.collect() }
    }
}

/// What must be read from it when it was stored in layout 2 or 3: without the limits that came with layout 4.
pub fn limited_as_layout_3(set: &StoredParameters) -> StoredParameters {
    let mut set = untold(set);
    for axis in set.axes.iter_mut().flatten() {
        axis.position_load = PositionLoad::default();
        axis.config = Config {
            supply_low_v: Optional::NONE,
            supply_high_v: Optional::NONE,
            acceleration_limit_rad_s2: Optional::NONE,
            jerk_limit_rad_s3: Optional::NONE,
            voltage_limit_v: Optional::NONE,
            ..axis.config
        };
    }
    set
}

/// … in layout 1: the same axes with the tuning that a new image gives them, too.
pub fn migrated(set: &StoredParameters) -> StoredParameters {
    let mut set = limited_as_layout_3(set);
    for axis in set.axes.iter_mut().flatten() {
        axis.tuning = Tuning::default();
        axis.compensation = true;
    }
    set
}
