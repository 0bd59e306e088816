//! `axis.toml` → [`Setup`]: what the firmware may know about its axis before it has moved, and what its user chooses.

use crate::device::link::{range_text, scale_text};
use crate::device::setup::{Choices, Loops, Setup, Wiring};
use crate::device::{board, parameters};
use serde::{Deserialize, de::DeserializeOwned};
use servo::config::{Config, SETTINGS, Setting, Value as Number};
use servo::protect::{Action, Fault, SettingsError, Thermal};
use std::collections::BTreeMap;
use std::path::Path;
use toml::{Spanned, Value};
use truing_core::text::input_error::{InputError, line_of, line_of_key, nearest_hint};

/// Keys and values of a section.
type Section = BTreeMap<Spanned<String>, Spanned<Value>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    board: Option<Spanned<String>>,
    supply: Spanned<Section>,
    encoder: Spanned<Section>,
    axis: Spanned<Section>,
    limits: Option<Spanned<Section>>,
    #[serde(default)]
    loops: Loops,
    /// Fault → action.
    #[serde(default)]
    protection: BTreeMap<Spanned<String>, Spanned<String>>,
}

/// Keys of `[limits]` that are no settings of [`Config`].
const PROTECTION_LIMITS: [&str; 3] =
    ["continuous_current_a", "thermal_time_constant_s", "command_timeout_ms"];

/// Reads and checks the file.
pub fn read(path: &Path) -> Result<Setup, InputError> {
    let source = path.display();
    parse(&source.to_string(), &truing_files::text(path)?)
}

/// Checks a text; `source` names it in messages.
pub fn parse(source: &str, text: &str) -> Result<Setup, InputError> {
    let file: File = toml::from_str(text).map_err(|error| syntax(source, text, &error))?;
    let reader = Reader { source, text, file };
    let (actions, thermal) = (reader.actions()?, reader.thermal()?);
    let (loops, command_timeout_ms) = (reader.file.loops, reader.limit("command_timeout_ms"));
    let setup = Setup {
        wiring: reader.wiring()?,
        choices: Choices { thermal, command_timeout_ms: command_timeout_ms?, loops, actions },
        config: reader.config()?,
    };
    let setup = reader.on_its_board(setup)?;
    setup.parameters(None).check().map(|_| setup).map_err(|error| match error {
        SettingsError::Value(error) => {
            reader.at(error.field.name(), format!("out of range: {}", range_text(&error)))
        }
        // Refused above, with its line.
        SettingsError::Action(pair) => {
            InputError::file(source, format!("protection.{} cannot be so", pair.fault.name()))
        }
    })
}

/// Names table and key, which the parser's own words leave out, and the nearest known key.
fn syntax(source: &str, text: &str, error: &toml::de::Error) -> InputError {
    let message = in_words(error.message());
    let Some(span) = error.span() else {
        return InputError::line(source, 1, message);
    };
    let (before, here) = text.split_at(span.start.min(text.len()));
    let line = [before.rsplit('\n').next(), here.lines().next()].map(Option::unwrap_or_default).concat();
    let header = |line: &str| {
        let line = line.trim();
        line.starts_with('[').then(|| line.to_owned())
    };
    let table = before.lines().rev().find_map(header).unwrap_or_default();
    let key = line.split_once('=').map_or("", |(key, _)| key.trim());
    let mut quoted = message.split('`').skip(1).step_by(2);
    let hint = match quoted.next() {
        Some(wrong) if message.starts_with("unknown field") => nearest_hint(wrong, quoted),
        _ => String::new(),
    };
    let place = match (table.is_empty() || header(&line).is_some(), key.is_empty()) {
        (true, _) => String::new(),
        (false, true) => format!("{table}: "),
        (false, false) => format!("{table} {key}: "),
    };
    InputError::line(source, line_of(text, span.start), format!("{place}{message}{hint}"))
}

/// The parser's sentence in words that need no Rust: its types, and a section that is missing with what it must hold.
fn in_words(message: &str) -> String {
    let types = [
        ("expected f32", "expected a number"),
        ("expected u32", "expected a whole number from 0"),
        ("expected u16", "expected a whole number from 0"),
        ("expected a boolean", "expected true or false"),
        ("expected a tuple of size 2", "expected two numbers, [from, to]"),
        ("expected an array of length 2", "expected two numbers, [from, to]"),
    ];
    let message = message.trim_end().replace('\n', " ");
    let message = types.iter().fold(message, |text, (theirs, ours)| text.replace(theirs, ours));
    let Some(section) = message.strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`'))
    else {
        return message;
    };
    let required = SETTINGS.iter().filter(|row| (row.fallback)(&Config::EXAMPLE).is_none());
    let required = required.filter_map(|row| row.field.name().split_once('.'));
    let keys: Vec<&str> = required.filter(|(of, _)| *of == section).map(|(_, key)| key).collect();
    format!("the section [{section}] is missing; it must hold {}", keys.join(" and "))
}

/// The file, and its text for messages.
struct Reader<'a> {
    source: &'a str,
    text: &'a str,
    file: File,
}

impl Reader<'_> {
    /// A complaint about `table.key`.
    fn at(&self, name: &str, words: String) -> InputError {
        let (table, key) = name.split_once('.').unwrap_or_default();
        InputError::line(self.source, line_of_key(self.text, table, key), words)
    }

    /// A complaint about what stands here.
    fn here<T>(&self, place: &Spanned<T>, words: impl std::fmt::Display) -> InputError {
        InputError::line(self.source, line_of(self.text, place.span().start), words)
    }

    /// A value that is none of this type, in the parser's own words.
    fn typed<T: DeserializeOwned>(&self, key: &str, value: &Spanned<Value>) -> Result<T, InputError> {
        let wrong = |why: toml::de::Error| self.here(value, format!("{key}: {}", in_words(why.message())));
        value.get_ref().clone().try_into().map_err(wrong)
    }

    /// The board that the file names, and which scales it leaves to a board.
    fn wiring(&self) -> Result<Wiring, InputError> {
        let named =
            |name: &Spanned<String>| board::named(name.get_ref()).map_err(|error| self.here(name, error));
        Ok(Wiring {
            board: self.file.board.as_ref().map(named).transpose()?.map(|board| board.name),
            supply: self.file.value("supply", "vbus_v_per_lsb").is_none(),
            current: self.file.value("limits", "current_a_per_lsb").is_none(),
        })
    }

    /// With the scales that the table of boards has for it, until a servo tells its own.
    fn on_its_board(&self, setup: Setup) -> Result<Setup, InputError> {
        let Some(name) = setup.wiring.board else { return Ok(setup) };
        let scales = board::scales(board::named(name)?);
        let config = setup.scaled(scales);
        scales.allow(&config).map_err(|error| self.at(error.field.name(), scale_text(&error)))?;
        Ok(Setup { config, ..setup })
    }

    /// Every setting: from the file, else its default.
    fn config(&self) -> Result<Config, InputError> {
        let mut config = Config::EXAMPLE;
        for section in ["supply", "encoder", "axis", "limits"] {
            self.known(section)?;
            let rows = SETTINGS.iter().filter(|row| row.field.name().split('.').next() == Some(section));
            for row in rows {
                self.setting(&mut config, row, section)?;
            }
        }
        Ok(config)
    }

    fn setting(&self, config: &mut Config, row: &Setting, section: &str) -> Result<(), InputError> {
        let key = row.field.name().split('.').nth(1).unwrap_or_default();
        let value = match self.file.value(section, key) {
            Some(value) => self.value(&format!("[{section}] {key}"), value, (row.get)(&Config::EXAMPLE))?,
            None => (row.fallback)(config).ok_or_else(|| {
                let what = format!("[{section}] {key} is missing; it must be {}", row.range);
                let section = self.file.section(section);
                section.map_or_else(|| InputError::line(self.source, 1, &what), |s| self.here(s, &what))
            })?,
        };
        let what = || format!("[{section}] {key} must be {}", row.range);
        (row.set)(config, value).ok_or_else(|| self.at(row.field.name(), what()))
    }

    /// A value in the type of its setting.
    fn value(&self, key: &str, value: &Spanned<Value>, like: Number) -> Result<Number, InputError> {
        Ok(match like {
            Number::Whole(_) => Number::Whole(self.typed(key, value)?),
            _ if value.get_ref().is_array() => Number::Pair(self.typed(key, value)?),
            _ => Number::Number(self.typed(key, value)?),
        })
    }

    /// Refuses unknown keys, and names the nearest one.
    fn known(&self, section: &str) -> Result<(), InputError> {
        let settings = SETTINGS.iter().filter_map(|row| row.field.name().split_once('.'));
        let mut known: Vec<&str> = settings.filter(|(of, _)| *of == section).map(|(_, key)| key).collect();
        if section == "limits" {
            known.extend(PROTECTION_LIMITS);
        }
        let mut keys = self.file.section(section).into_iter().flat_map(|table| table.get_ref().keys());
        let Some(key) = keys.find(|key| !known.contains(&key.get_ref().as_str())) else { return Ok(()) };
        let name = key.get_ref();
        let all = known.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ");
        let near = nearest_hint(name, known.iter().copied());
        let what = format!("[{section}] {name}: unknown field `{name}`, expected one of {all}{near}");
        Err(self.here(key, what))
    }

    /// A key of `[limits]` that is no setting of [`Config`].
    fn limit<T: DeserializeOwned>(&self, key: &str) -> Result<Option<T>, InputError> {
        let value = self.file.value("limits", key);
        value.map(|value| self.typed(&format!("[limits] {key}"), value)).transpose()
    }

    /// Both numbers make the thermal limit; the time constant alone is none.
    fn thermal(&self) -> Result<Option<Thermal>, InputError> {
        let continuous: Option<f32> = self.limit("continuous_current_a")?;
        match (continuous, self.limit("thermal_time_constant_s")?) {
            (None, Some::<u16>(_)) => Err(InputError::file(
                self.source,
                "limits.thermal_time_constant_s needs limits.continuous_current_a beside it: the current that the \
                 winding carries for ever",
            )),
            (continuous, seconds) => Ok(continuous.map(|continuous_a| Thermal {
                continuous_a,
                time_constant_s: seconds.unwrap_or(parameters::SMALL_MOTOR.time_constant_s),
            })),
        }
    }

    /// The table *fault × action*.
    fn actions(&self) -> Result<[Option<Action>; Fault::ALL.len()], InputError> {
        let mut actions = [None; Fault::ALL.len()];
        for (fault, action) in &self.file.protection {
            let (fault, action) = parameters::entry(fault.get_ref(), action.get_ref())
                .map_err(|error| self.here(fault, error))?;
            if let Some(place) = Fault::ALL.iter().position(|known| *known == fault) {
                actions[place] = Some(action);
            }
        }
        Ok(actions)
    }
}

impl File {
    fn section(&self, name: &str) -> Option<&Spanned<Section>> {
        match name {
            "supply" => Some(&self.supply),
            "encoder" => Some(&self.encoder),
            "axis" => Some(&self.axis),
            _ => self.limits.as_ref(),
        }
    }

    fn value(&self, section: &str, key: &str) -> Option<&Spanned<Value>> {
        let table = self.section(section)?.get_ref();
        table.iter().find(|(name, _)| name.get_ref() == key).map(|(_, value)| value)
    }
}
