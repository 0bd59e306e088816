//! `axis.toml` → [`servo::config::Config`]: what the firmware may know about its axis before it has moved.

use crate::input_error::InputError;
use serde::Deserialize;
use servo::config::Config;
use std::path::Path;

/// Reload value of TIM1 for 20 kHz centre-aligned PWM at 168 MHz.
const PWM_FULL_SCALE: u16 = 4200;
/// Full scale of a 12-bit converter.
const CONVERTER_FULL_SCALE: f32 = 4096.0;
/// The supply converter reaches this many times the nominal voltage, so that regeneration does not clip it.
const SUPPLY_HEADROOM: f32 = 2.0;
/// Current per converter count when the file does not say: ±20 A over 12 bits.
const CURRENT_A_PER_LSB: f32 = 40.0 / CONVERTER_FULL_SCALE;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    supply: Supply,
    encoder: Encoder,
    axis: Axis,
    #[serde(default)]
    limits: Limits,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Supply {
    nominal_v: f32,
    vbus_v_per_lsb: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Encoder {
    counts_per_rev: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Axis {
    rated_speed_rad_s: f32,
    tick_hz: Option<u32>,
    time_constant_hint_s: Option<f32>,
    gear_ratio: Option<f32>,
    travel_limit_rad: Option<[f32; 2]>,
    pwm_delay_ticks: Option<u8>,
    pwm_full_scale: Option<u16>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Limits {
    current_a: Option<f32>,
    energy_j: Option<f32>,
    speed_rad_s: Option<f32>,
    current_a_per_lsb: Option<f32>,
}

/// Reads and checks the file.
pub fn read(path: &Path) -> Result<Config, InputError> {
    let source = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|e| InputError::file(&source, format!("cannot be read ({e}); check the path")))?;
    parse(&source.to_string(), &text)
}

/// Checks a text; `source` names it in messages.
pub fn parse(source: &str, text: &str) -> Result<Config, InputError> {
    let file: File = toml::from_str(text).map_err(|error| syntax(source, text, &error))?;
    let config = file.config();
    config.build().map_err(|error| {
        let (field, low, high) = (error.field.name(), error.minimum, error.maximum);
        InputError::file(
            source,
            format!("{field} is out of range; it must lie between {low} and {high}"),
        )
    })?;
    Ok(config)
}

fn syntax(source: &str, text: &str, error: &toml::de::Error) -> InputError {
    let line = error.span().map_or(1, |span| {
        1 + text[..span.start.min(text.len())].matches('\n').count()
    });
    InputError::line(source, line as u64, error.message().replace('\n', " "))
}

impl File {
    fn config(self) -> Config {
        let nominal = self.supply.nominal_v;
        Config {
            supply_nominal_v: nominal,
            counts_per_rev: self.encoder.counts_per_rev,
            rated_speed_rad_s: self.axis.rated_speed_rad_s,
            tick_hz: self.axis.tick_hz.unwrap_or(10_000),
            time_constant_hint_s: self.axis.time_constant_hint_s,
            gear_ratio: self.axis.gear_ratio.unwrap_or(1.0),
            travel_limit_rad: self.axis.travel_limit_rad,
            current_limit_a: self.limits.current_a,
            energy_limit_j: self.limits.energy_j,
            speed_limit_rad_s: self.limits.speed_rad_s,
            pwm_delay_ticks: self.axis.pwm_delay_ticks.unwrap_or(1),
            pwm_full_scale: self.axis.pwm_full_scale.unwrap_or(PWM_FULL_SCALE),
            vbus_v_per_lsb: self
                .supply
                .vbus_v_per_lsb
                .unwrap_or(SUPPLY_HEADROOM * nominal / CONVERTER_FULL_SCALE),
            current_a_per_lsb: self.limits.current_a_per_lsb.unwrap_or(CURRENT_A_PER_LSB),
        }
    }
}
