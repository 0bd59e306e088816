//! What is in force on an axis, key by key: what `truing params get` prints and `set` takes. Keys are those of
//! `axis.toml`, and four sections more: `loops` for what the user may choose about the loops, `protection` for what the
//! bridge does about a fault, `identified` for what a commissioning has found and a model tells (`doubted` for what of the latter is
//! kept and does not act), `position_load` for the load over the place.

use crate::device::commission_report::{Kept, Params};
use crate::device::link::range_text;
use crate::device::place_load::PlaceLoad;
use servo::compensate::modelled::{Modelled, NAMES, NUMBERS};
use servo::compensate::position_load::PositionLoad;
use servo::config::{Config, SETTINGS, Setting, Value};
use servo::identify::estimate::{EstimatesReport, Reported};
use servo::protect::{Action, Fault, Thermal};
use servo::store::AxisParameters;
use std::fmt::Write as _;
use truing_core::text::input_error::{InputError, nearest};

/// Keys of the load over the place, those of `params.toml`.
const LOAD: &str = "position_load";
/// Section of what a commissioning finds and a model tells.
const IDENTIFIED: &str = "identified.";
/// Section of what a model tells and is not trusted.
const DOUBTED: &str = "doubted.";
/// Unsets an optional number.
const NONE: &str = "none";

/// One key.
struct Key {
    name: &'static str,
    /// As TOML; `None`: not set.
    get: fn(&AxisParameters) -> Option<String>,
    /// `None`: the text is no value of this key.
    set: fn(&mut AxisParameters, &str) -> Option<()>,
}

/// A key whose field has a number of this type.
macro_rules! plain {
    ($name:literal, $($field:ident).+) => {
        Key {
            name: $name,
            get: |p| Some(p.$($field).+.to_string()),
            set: |p, text| {
                p.$($field).+ = text.parse().ok()?;
                Some(())
            },
        }
    };
}

/// A key of the thermal limit, which both of its numbers make together.
macro_rules! thermal {
    ($name:literal, $field:ident) => {
        Key {
            name: $name,
            get: |p| p.protection.thermal.map(|thermal| thermal.$field.to_string()),
            set: |p, text| {
                thermal(p, text, |thermal, text| text.parse().map(|value| thermal.$field = value).ok())
            },
        }
    };
}

/// A key of an estimate: the field here, in the report, and in `params.toml` have one name.
macro_rules! identified {
    ($name:literal, $field:ident, $($estimate:tt)+) => {
        Key {
            name: $name,
            get: |p| estimates(p).and_then(|report| number(&report.$field)),
            set: |p, text| {
                let value = text.parse().ok()?;
                let params = Params {
                    $field: Some(Kept { value, u95: 0.0, trusted: true }),
                    ..Params::nothing()
                };
                p.estimates.$($estimate)+ = params.estimates(&p.config).$($estimate)+;
                Some(())
            },
        }
    };
}

/// Keys beside the settings of [`SETTINGS`].
const KEYS: &[Key] = &[
    plain!("limits.command_timeout_ms", protection.command_timeout_ms),
    thermal!("limits.continuous_current_a", continuous_a),
    thermal!("limits.thermal_time_constant_s", time_constant_s),
    plain!("loops.bandwidth", tuning.bandwidth),
    plain!("loops.integral", tuning.integral),
    plain!("loops.compensation", compensation),
    identified!("identified.dead_zone_pos_v", dead_zone_pos_v, dead_zone[0]),
    identified!("identified.dead_zone_neg_v", dead_zone_neg_v, dead_zone[1]),
    identified!("identified.saturation_pos_v", saturation_pos_v, saturation[0]),
    identified!("identified.saturation_neg_v", saturation_neg_v, saturation[1]),
    identified!("identified.gain_rad_s_per_v", gain_rad_s_per_v, gain),
    identified!("identified.time_constant_s", time_constant_s, time_constant),
];

/// The thermal limit of a small motor.
pub(crate) const SMALL_MOTOR: Thermal = Thermal { continuous_a: 1.0, time_constant_s: 30 };

/// The thermal model appears with its first number, with a small motor's values for the other.
fn thermal(p: &mut AxisParameters, text: &str, put: fn(&mut Thermal, &str) -> Option<()>) -> Option<()> {
    if text == NONE {
        p.protection.thermal = None;
        return Some(());
    }
    let mut thermal = p.protection.thermal.unwrap_or(SMALL_MOTOR);
    put(&mut thermal, text)?;
    p.protection.thermal = Some(thermal);
    Some(())
}

/// `protection.FAULT`: what the bridge does about it. Only what differs from `open` is printed.
const PROTECTION: &str = "protection.";

/// The entry of the table *fault × action* that these two names make.
pub(crate) fn entry(fault: &str, action: &str) -> Result<(Fault, Action), InputError> {
    let Some(fault) = Fault::ALL.into_iter().find(|known| known.name() == fault) else {
        let near = nearest(fault, Fault::ALL.iter().map(|known| known.name()));
        let near = near.map_or(String::new(), |near| format!("the nearest is {near}, "));
        let all = Fault::ALL.map(Fault::name).join(", ");
        return Err(InputError(format!("`{fault}` is no fault of [protection]; {near}all are {all}")));
    };
    let actions = [Action::Open, Action::Brake, Action::Hold];
    let chosen = actions.into_iter().find(|known| known.name() == action);
    let fitting = chosen.filter(|action| action.suits(fault));
    fitting.map(|action| (fault, action)).ok_or_else(|| {
        let fitting = actions.iter().filter(|action| action.suits(fault));
        let names: Vec<&str> = fitting.map(|action| action.name()).collect();
        let (of, all) = (fault.name(), names.join(" or "));
        InputError(format!("{PROTECTION}{of} cannot be `{action}`; choose {all}"))
    })
}

fn set_action(parameters: &mut AxisParameters, fault: &str, action: &str) -> Result<(), InputError> {
    let (fault, action) = entry(fault, action)?;
    let table = parameters.protection.actions.with(fault, action);
    parameters.protection.actions = table.unwrap_or(parameters.protection.actions);
    Ok(())
}

fn estimates(parameters: &AxisParameters) -> Option<EstimatesReport> {
    let scale = parameters.config.build().ok()?;
    Some(parameters.estimates.report(&scale))
}

/// Only what is used.
fn number(reported: &Reported) -> Option<String> {
    reported.value.filter(|_| reported.trusted).map(|value| value.to_string())
}

fn pair(text: &str) -> Option<[f32; 2]> {
    let (low, high) = text.trim_matches(['[', ']']).split_once(',')?;
    Some([low.trim().parse().ok()?, high.trim().parse().ok()?])
}

/// One line a key, in TOML; what is not set is left out.
pub fn print(parameters: &AxisParameters) -> String {
    let mut text = String::new();
    let others = KEYS.iter().filter_map(|key| Some((key.name, (key.get)(parameters)?)));
    for (name, value) in settings(parameters).chain(others) {
        let _ = writeln!(text, "{name} = {value}");
    }
    for ([key, ..], value, trusted) in modelled(parameters) {
        let _ = writeln!(text, "{}{key} = {value}", if trusted { IDENTIFIED } else { DOUBTED });
    }
    for fault in Fault::ALL {
        let action = parameters.protection.actions.of(fault);
        if action != Action::Open {
            let _ = writeln!(text, "{PROTECTION}{} = \"{}\"", fault.name(), action.name());
        }
    }
    let load = load(parameters).filter(|_| parameters.position_load != PositionLoad::default());
    for (key, value) in load.into_iter().flatten() {
        let _ = writeln!(text, "{LOAD}.{key} = {value}");
    }
    text
}

/// The load over the place as TOML; there is always a table to set a key of.
fn load(parameters: &AxisParameters) -> Option<toml::Table> {
    let mut load = PlaceLoad::of(&parameters.position_load, &parameters.config);
    if load.period_counts == 0 {
        load = PlaceLoad { on: true, trusted: true, period_counts: parameters.config.counts_per_rev, ..load };
    }
    toml::Table::try_from(load).ok()
}

fn set_load(parameters: &mut AxisParameters, key: &str, value: &str) -> Result<(), InputError> {
    if value == NONE {
        parameters.position_load = PositionLoad::default();
        return Ok(());
    }
    let wrong =
        |error: toml::de::Error| InputError(format!("{LOAD}.{key}: {}", error.message().replace('\n', " ")));
    let mut table = load(parameters).unwrap_or_default();
    table.insert(key.into(), value.parse().map_err(wrong)?);
    let load: PlaceLoad = table.try_into().map_err(wrong)?;
    parameters.position_load = load.build(&parameters.config).map_err(|it| InputError(range_text(&it)))?;
    Ok(())
}

/// Settings that are set, section by section in the order of their first rows.
fn settings(parameters: &AxisParameters) -> impl Iterator<Item = (&'static str, String)> {
    let mut rows: Vec<&Setting> = SETTINGS.iter().collect();
    let first = |row: &Setting| SETTINGS.iter().position(|other| section(other) == section(row));
    rows.sort_by_key(|row| first(row));
    let config = parameters.config;
    rows.into_iter().filter_map(move |row| Some((row.field.name(), text_of((row.get)(&config))?)))
}

fn section(row: &Setting) -> &'static str {
    row.field.name().split('.').next().unwrap_or_default()
}

/// As TOML; `None`: not set.
fn text_of(value: Value) -> Option<String> {
    match value {
        Value::None => None,
        Value::Number(number) => Some(number.to_string()),
        Value::Whole(count) => Some(count.to_string()),
        Value::Pair([low, high]) => Some(format!("[{low}, {high}]")),
    }
}

/// Puts the value of a text in; `None`: it is no value of this setting.
fn put(config: &mut Config, row: &Setting, text: &str) -> Option<()> {
    let readings = [
        (text == NONE).then_some(Value::None),
        text.parse().ok().map(Value::Whole),
        text.parse().ok().map(Value::Number),
        pair(text).map(Value::Pair),
    ];
    readings.into_iter().flatten().find_map(|value| (row.set)(config, value))
}

/// Takes `key=value` over. The set as a whole is checked by the servo.
pub fn set(parameters: &mut AxisParameters, assignment: &str) -> Result<(), InputError> {
    let no =
        || InputError(format!("`{assignment}` is no assignment; write key=value, e.g. loops.bandwidth=1.5"));
    let (name, value) = assignment.split_once('=').ok_or_else(no)?;
    let (name, value) = (name.trim(), value.trim());
    if let Some(fault) = name.strip_prefix(PROTECTION) {
        return set_action(parameters, fault, value.trim_matches('"'));
    }
    if let Some(key) = name.strip_prefix(LOAD).and_then(|key| key.strip_prefix('.')) {
        return set_load(parameters, key, value);
    }
    let before = *parameters;
    let row = SETTINGS.iter().find(|row| row.field.name() == name);
    let key = KEYS.iter().find(|key| key.name == name);
    let section = if name.starts_with(DOUBTED) { DOUBTED } else { IDENTIFIED };
    let told = name.strip_prefix(section).and_then(|key| NAMES.iter().position(|it| it[0] == key));
    let done = match (row, key, told) {
        (Some(row), ..) => put(&mut parameters.config, row, value),
        (_, Some(key), _) => (key.set)(parameters, value),
        (.., Some(at)) => {
            value.parse().ok().and_then(|value| tell(parameters, at, value, section == IDENTIFIED))
        }
        _ => return Err(no_key(name)),
    };
    let most = |at| format!("at most {:.3}", Modelled::most(&before.config)[at]);
    let most = told.map_or("true or false".into(), most);
    let wrong = || InputError(format!("`{value}` is no value of {name}; write a number, {most}"));
    done.ok_or_else(wrong)?;
    if units(&before.config) != units(&parameters.config)
        && let Some(report) = estimates(&before)
    {
        // A volt stays a volt when the units of the estimates change.
        parameters.estimates = Params::new(report.mechanism, &(&report).into()).estimates(&parameters.config);
        for (at, value) in before.modelled.values(&before.config).into_iter().enumerate() {
            tell(parameters, at, value, parameters.modelled.trusts(at)).unwrap_or_default();
        }
    }
    Ok(())
}

fn no_key(name: &str) -> InputError {
    let all = SETTINGS.iter().map(|row| row.field.name());
    let told = NAMES.map(|it| format!("{IDENTIFIED}{}", it[0]));
    let near =
        nearest(name, all.chain(KEYS.iter().map(|key| key.name)).chain(told.iter().map(String::as_str)));
    let near = near.map_or(String::new(), |near| format!("; the nearest is {near}"));
    InputError(format!("`{name}` is no key{near} (`truing params get` lists those that are set)"))
}

/// What the chip's estimates count in.
fn units(config: &Config) -> (f32, f32, u32) {
    (config.supply_nominal_v, config.rated_speed_rad_s, config.tick_hz)
}

/// What a model has told of an axis: key, name and unit; value; whether it acts.
pub fn modelled(of: &AxisParameters) -> impl Iterator<Item = ([&'static str; 3], f32, bool)> {
    let values = of.modelled.values(&of.config);
    let told = (0..NUMBERS).map(move |at| (NAMES[at], values[at], of.modelled.trusts(at)));
    told.filter(|(_, value, _)| *value != 0.0)
}

fn tell(of: &mut AxisParameters, at: usize, value: f32, trusted: bool) -> Option<()> {
    of.modelled.with(at, value, trusted, &of.config).map(|told| of.modelled = told)
}

/// Numbers of `params.toml` put in force; of the load over the place as much as the chip allows.
pub fn adopt(parameters: &mut AxisParameters, params: &Params) -> Result<(), InputError> {
    parameters.config.counts_per_rev = params.counts_per_rev.unwrap_or(parameters.config.counts_per_rev);
    let estimates = params.estimates(&parameters.config);
    parameters.estimates.merge(&estimates);
    for (name, told) in &params.modelled {
        let section = if told.trusted { IDENTIFIED } else { DOUBTED };
        set(parameters, &format!("{section}{name}={}", told.value))?;
    }
    let Some(mut load) = params.position_load.clone() else { return Ok(()) };
    load.fit(&parameters.config);
    let table = load.build(&parameters.config).map_err(|error| InputError(range_text(&error)));
    table.map(|table| parameters.position_load = table)
}
