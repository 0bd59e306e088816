//! Sets of parameters as older images stored them, and what a set of today is made of them.

use super::AxisParameters;
use crate::compensate::modelled::Modelled;
use crate::compensate::position_load::PositionLoad;
use crate::config::{Config, LATEST};
use crate::control::Tuning;
use crate::protect::Settings;
use serde::{Deserialize, de::DeserializeOwned};

/// The configuration up to layout 3, which knew no thresholds of the supply and no limits of acceleration, jerk and
/// voltage.
#[derive(Deserialize)]
struct Config3 {
    supply_nominal_v: f32,
    counts_per_rev: u32,
    rated_speed_rad_s: f32,
    tick_hz: u32,
    time_constant_hint_s: Option<f32>,
    gear_ratio: f32,
    travel_limit_rad: Option<[f32; 2]>,
    current_limit_a: Option<f32>,
    energy_limit_j: Option<f32>,
    speed_limit_rad_s: Option<f32>,
    pwm_delay_ticks: u8,
    pwm_full_scale: u16,
    vbus_v_per_lsb: f32,
    current_a_per_lsb: f32,
}

impl Config3 {
    fn migrate(self) -> Config {
        Config {
            supply_nominal_v: self.supply_nominal_v,
            counts_per_rev: self.counts_per_rev,
            rated_speed_rad_s: self.rated_speed_rad_s,
            tick_hz: self.tick_hz,
            time_constant_hint_s: self.time_constant_hint_s.into(),
            gear_ratio: self.gear_ratio,
            travel_limit_rad: self.travel_limit_rad,
            current_limit_a: self.current_limit_a.into(),
            energy_limit_j: self.energy_limit_j.into(),
            speed_limit_rad_s: self.speed_limit_rad_s.into(),
            pwm_delay_ticks: self.pwm_delay_ticks,
            pwm_full_scale: self.pwm_full_scale,
            vbus_v_per_lsb: self.vbus_v_per_lsb,
            current_a_per_lsb: self.current_a_per_lsb,
            ..Config::EXAMPLE
        }
    }
}

/// The next axis of a set in an older layout; `None`: it cannot be read. An axis that is none was never configured.
///
/// Part by part: what the layouts have in common is decoded by the same code.
pub(super) fn axis(layout: u16, rest: &mut &[u8]) -> Option<Option<AxisParameters>> {
    // Layout 3 came with axes that were never configured: an optional is a byte, zero or one, before the content.
    if layout >= 3 && !take::<bool>(rest)? {
        return Some(None);
    }
    // From layout 4 on every setting tells the layout in which it came.
    let config = match layout {
        1..=3 => take::<Config3>(rest)?.migrate(),
        // As it is now: the image needs no look at what came when.
        LATEST.. => take(rest)?,
        _ => Config::take(layout, rest, &Config::EXAMPLE)?,
    };
    let estimates = take(rest)?;
    // Layout 1 knew no choice about the loops, layout 2 none about protection.
    let (tuning, compensation) = match layout {
        1 => (Tuning::default(), true),
        _ => (take(rest)?, take(rest)?),
    };
    let protection = match layout {
        1 | 2 => Settings::default(),
        _ => take(rest)?,
    };
    // Layout 5 came with the load over the place.
    let position_load = match layout {
        1..=4 => PositionLoad::default(),
        _ => take(rest)?,
    };
    // Layout 6 came with the lag; what came later stands in upper bits of the same number, and behind it.
    let modelled = if layout > 5 { take(rest)? } else { Modelled::default() };
    Some(Some(AxisParameters {
        config,
        estimates,
        tuning,
        compensation,
        protection,
        position_load,
        modelled,
    }))
}

/// The next item.
pub(super) fn take<T: DeserializeOwned>(rest: &mut &[u8]) -> Option<T> {
    let (item, behind) = postcard::take_from_bytes(rest).ok()?;
    *rest = behind;
    Some(item)
}
