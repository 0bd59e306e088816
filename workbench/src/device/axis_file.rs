//! `axis.toml` → [`Setup`]: what the firmware may know about its axis before it has moved, and what its user chooses.

use crate::console::input_error::{InputError, nearest};
use crate::device::link::range_text;
use crate::device::parameters;
use crate::device::setup::{Choices, Setup};
use serde::Deserialize;
use servo::config::Config;
use servo::protect::{Fault, SettingsError, Thermal};
use std::collections::BTreeMap;
use std::path::Path;
use toml::Spanned;

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
    #[serde(default)]
    loops: Loops,
    /// Fault → action.
    #[serde(default)]
    protection: BTreeMap<Spanned<String>, Spanned<String>>,
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
    continuous_current_a: Option<f32>,
    thermal_time_constant_s: Option<u16>,
    command_timeout_ms: Option<u16>,
    supply_low_v: Option<f32>,
    supply_high_v: Option<f32>,
    acceleration_rad_s2: Option<f32>,
    jerk_rad_s3: Option<f32>,
    voltage_v: Option<f32>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Loops {
    bandwidth: Option<f32>,
    integral: Option<bool>,
    compensation: Option<bool>,
}

/// Reads and checks the file.
pub fn read(path: &Path) -> Result<Setup, InputError> {
    let source = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|e| InputError::file(&source, format!("cannot be read ({e}); check the path")))?;
    parse(&source.to_string(), &text)
}

/// Checks a text; `source` names it in messages.
pub fn parse(source: &str, text: &str) -> Result<Setup, InputError> {
    let file: File = toml::from_str(text).map_err(|error| syntax(source, text, &error))?;
    let actions = file.actions(source, text)?;
    let thermal = file.limits.thermal(source)?;
    let setup = Setup {
        choices: Choices {
            thermal,
            command_timeout_ms: file.limits.command_timeout_ms,
            bandwidth: file.loops.bandwidth,
            integral: file.loops.integral,
            compensation: file.loops.compensation,
            actions,
        },
        config: file.config(),
    };
    setup.parameters(None).check().map_err(|error| match error {
        SettingsError::Value(error) => {
            let words = format!("out of range: {}", range_text(&error));
            match line_of_key(text, error.field.name()) {
                Some(line) => InputError::line(source, line, words),
                None => InputError::file(source, words),
            }
        }
        // Refused above, with its line.
        SettingsError::Action(pair) => {
            InputError::file(source, format!("protection.{} cannot be so", pair.fault.name()))
        }
    })?;
    Ok(setup)
}

fn line_of(text: &str, place: usize) -> u64 {
    1 + text[..place.min(text.len())].matches('\n').count() as u64
}

/// The line of `table.key`, if the file has it; the file is known to be TOML with a header for every table.
fn line_of_key(text: &str, name: &str) -> Option<u64> {
    let (table, key) = name.split_once('.')?;
    let mut inside = false;
    for (line, number) in text.lines().map(str::trim).zip(1..) {
        if let Some(header) = line.strip_prefix('[') {
            inside = header.split(']').next().map(str::trim) == Some(table);
        } else if inside && line.split('=').next().map(str::trim) == Some(key) {
            return Some(number);
        }
    }
    None
}

/// Names table and key, which the parser's own words leave out, and the nearest known key.
fn syntax(source: &str, text: &str, error: &toml::de::Error) -> InputError {
    let message = error.message().replace('\n', " ");
    let Some(span) = error.span() else {
        return InputError::line(source, 1, message);
    };
    let (before, here) = text.split_at(span.start.min(text.len()));
    let line = [before.rsplit('\n').next(), here.lines().next()]
        .map(Option::unwrap_or_default)
        .concat();
    let header = |line: &str| {
        let line = line.trim();
        line.starts_with('[').then(|| line.to_owned())
    };
    let table = before.lines().rev().find_map(header).unwrap_or_default();
    let key = line.split_once('=').map_or("", |(key, _)| key.trim());
    let mut quoted = message.split('`').skip(1).step_by(2);
    let hint = match quoted.next() {
        Some(wrong) if message.starts_with("unknown field") => nearest(wrong, quoted)
            .map(|near| format!("; the nearest is `{near}`"))
            .unwrap_or_default(),
        _ => String::new(),
    };
    let place = match (table.is_empty() || header(&line).is_some(), key.is_empty()) {
        (true, _) => String::new(),
        (false, true) => format!("{table}: "),
        (false, false) => format!("{table} {key}: "),
    };
    InputError::line(
        source,
        line_of(text, span.start),
        format!("{place}{message}{hint}"),
    )
}

impl Limits {
    /// Both numbers make the thermal limit; the time constant alone is none.
    fn thermal(&self, source: &str) -> Result<Option<Thermal>, InputError> {
        match (self.continuous_current_a, self.thermal_time_constant_s) {
            (None, Some(_)) => Err(InputError::file(
                source,
                "limits.thermal_time_constant_s needs limits.continuous_current_a beside it: the current that the \
                 winding carries for ever",
            )),
            (continuous, seconds) => Ok(continuous.map(|continuous_a| Thermal {
                continuous_a,
                time_constant_s: seconds.unwrap_or(parameters::SMALL_MOTOR.time_constant_s),
            })),
        }
    }
}

impl File {
    /// The table *fault × action*.
    fn actions(
        &self,
        source: &str,
        text: &str,
    ) -> Result<[Option<servo::protect::Action>; Fault::ALL.len()], InputError> {
        let mut actions = [None; Fault::ALL.len()];
        for (fault, action) in &self.protection {
            let (fault, action) = parameters::entry(fault.get_ref(), action.get_ref())
                .map_err(|error| InputError::line(source, line_of(text, fault.span().start), error))?;
            for (known, slot) in Fault::ALL.into_iter().zip(&mut actions) {
                if known == fault {
                    *slot = Some(action);
                }
            }
        }
        Ok(actions)
    }

    fn config(&self) -> Config {
        let nominal = self.supply.nominal_v;
        Config {
            supply_nominal_v: nominal,
            counts_per_rev: self.encoder.counts_per_rev,
            rated_speed_rad_s: self.axis.rated_speed_rad_s,
            tick_hz: self.axis.tick_hz.unwrap_or(10_000),
            time_constant_hint_s: self.axis.time_constant_hint_s.into(),
            gear_ratio: self.axis.gear_ratio.unwrap_or(1.0),
            travel_limit_rad: self.axis.travel_limit_rad,
            current_limit_a: self.limits.current_a.into(),
            energy_limit_j: self.limits.energy_j.into(),
            speed_limit_rad_s: self.limits.speed_rad_s.into(),
            pwm_delay_ticks: self.axis.pwm_delay_ticks.unwrap_or(1),
            pwm_full_scale: self.axis.pwm_full_scale.unwrap_or(PWM_FULL_SCALE),
            vbus_v_per_lsb: self
                .supply
                .vbus_v_per_lsb
                .unwrap_or(SUPPLY_HEADROOM * nominal / CONVERTER_FULL_SCALE),
            current_a_per_lsb: self.limits.current_a_per_lsb.unwrap_or(CURRENT_A_PER_LSB),
            supply_low_v: self.limits.supply_low_v.into(),
            supply_high_v: self.limits.supply_high_v.into(),
            acceleration_limit_rad_s2: self.limits.acceleration_rad_s2.into(),
            jerk_limit_rad_s3: self.limits.jerk_rad_s3.into(),
            voltage_limit_v: self.limits.voltage_v.into(),
        }
    }
}
