//! Which keys a model file may have, and what their values may be: every complaint names section, key, line and remedy.

use super::complaints::File;
use super::keys;
use super::table::{self, KINDS, Key, Need, Takes, UNKNOWN};
use crate::text::input_error::nearest;
use toml::{Table, Value};

/// What the reader may be asked for who has a data sheet.
const SHEET: &str = "`truing start` turns what is printed on a motor into a model file";

impl File<'_> {
    /// Looks at every key of the file but those of known effects. `kind`: as far as it is known.
    pub(super) fn check(&self, root: &Table, kind: Option<&str>) {
        if !root.contains_key("schema") {
            self.wrong("", "schema", "is missing; begin the file with schema = \"truing-model/1\"");
        }
        for (name, value) in root {
            match value {
                Value::Table(_) if name == "known" => {}
                Value::Table(table) if table::sections().contains(&name.as_str()) => {
                    self.check_section(name, table, kind);
                }
                Value::Table(table) => self.other_section(name, table),
                _ if table::sections().contains(&name.as_str()) => {
                    self.wrong("", name, &format!("must be a section: write [{name}]"));
                }
                _ => self.outside(name, value),
            }
        }
    }

    fn check_section(&self, name: &str, table: &Table, kind: Option<&str>) {
        for (key, value) in table {
            match (name, table::find(name, key)) {
                ("tolerance", _) => self.tolerance(key, value, kind),
                (_, Some(row)) => self.check_value(name, row, value, kind),
                (_, None) => self.unknown_key(name, key, value, &table::names(name)),
            }
        }
    }

    /// A section of one's own holds texts alone.
    fn other_section(&self, name: &str, table: &Table) {
        let sections = table::sections();
        let texts = table.values().all(Value::is_str);
        let meant = keys::meant(name, sections.iter().copied());
        if texts && meant.is_none() {
            return;
        }
        let near = if texts { meant } else { nearest(name, sections.iter().copied()) };
        let known = sections.iter().map(|name| format!("[{name}]")).collect::<Vec<_>>().join(", ");
        let remedy =
            near.map_or(format!("the known ones are {known}"), |near| format!("the nearest is [{near}]"));
        self.wrong(name, "", &format!("is no known section; {remedy}"));
    }

    fn outside(&self, name: &str, value: &Value) {
        let row = table::find("", name);
        match (row, value) {
            (Some(row), value) => self.check_value("", row, value, None),
            (None, Value::Boolean(_)) if name == "fitted_to_log" => {}
            (None, Value::String(text)) if name == "kind" && KINDS.contains(&text.as_str()) => {
                self.wrong("", name, "stands outside a section; move it under [model]");
            }
            (None, Value::String(_)) => self.mistyped("", name, &table::names("")),
            (None, _) => {
                let section = table::KEYS.iter().find(|key| key.name == name).map(|key| key.section);
                let section = section.map_or("[motor], [tolerance], …".into(), |name| format!("[{name}]"));
                self.wrong("", name, &format!("stands outside a section; move it under {section}"));
            }
        }
    }

    /// A text under a name of its own is kept; a typing error of a known name is told.
    fn mistyped(&self, section: &str, key: &str, known: &[&str]) {
        let all = known.iter().copied().chain(keys::texts(section).iter().copied());
        if let Some(near) = keys::meant(key, all) {
            self.wrong(section, key, &format!("is no known key; the nearest is {near}"));
        }
    }

    /// A key that is in no row. `numbers`: the known ones of the section.
    fn unknown_key(&self, section: &str, key: &str, value: &Value, numbers: &[&str]) {
        match value {
            Value::String(text) if key == "kind" && KINDS.contains(&text.as_str()) => {
                self.wrong(section, key, "stands in the wrong section; move it under [model]");
            }
            Value::String(_) => self.mistyped(section, key, numbers),
            _ if section == "log" => self.note(section, key, "is no known key and is not used"),
            _ => {
                let elsewhere = table::KEYS.iter().find(|row| row.name == key && !row.section.is_empty());
                let known = match (elsewhere, nearest(key, numbers.iter().copied())) {
                    (Some(row), _) => format!("it belongs under [{}]", row.section),
                    (None, Some(near)) => format!("the nearest is {near}"),
                    (None, None) => format!("the known ones are {}", numbers.join(", ")),
                };
                let sheet = if table::BASE.contains(&section)
                    && elsewhere.is_none()
                    && !known.starts_with("the nearest")
                {
                    format!("; {SHEET}")
                } else {
                    String::new()
                };
                self.wrong(section, key, &format!("is no known key; {known}{sheet}"));
            }
        }
    }

    /// Keys of an effect: `numbers` are those that it knows besides the texts.
    pub(super) fn check_effect(&self, section: &str, table: &Table, numbers: &[&str]) {
        for (key, value) in table {
            match value {
                Value::String(_) if !numbers.contains(&key.as_str()) => self.mistyped(section, key, numbers),
                _ if numbers.contains(&key.as_str()) => {}
                _ if keys::texts(section).contains(&key.as_str()) => {
                    self.wrong(section, key, "must be a text in quotes");
                }
                _ => self.unknown_key(section, key, value, numbers),
            }
        }
    }

    /// The value of a key that is in a row.
    fn check_value(&self, section: &str, row: &Key, value: &Value, kind: Option<&str>) {
        if let Some(kind) = kind.filter(|kind| !row.read_by(kind)) {
            self.note(section, row.name, &format!("is not used by kind = \"{kind}\""));
        }
        match (row.takes, value) {
            (Takes::Positive | Takes::NotNegative, _) => self.check_number(section, row, value),
            (Takes::Flag, _) => self.check_flag(section, row, value),
            (Takes::Text, Value::String(_)) => {}
            (Takes::Choice(values), Value::String(text)) => self.check_choice(section, row, text, values),
            (Takes::ChoiceOrWords(values), Value::String(text)) => {
                self.check_words(section, row, text, values)
            }
            (Takes::Text | Takes::Choice(_) | Takes::ChoiceOrWords(_), _) => {
                self.wrong(section, row.name, "must be a text in quotes")
            }
        }
    }

    fn check_number(&self, section: &str, row: &Key, value: &Value) {
        match value {
            Value::String(text) if is_unknown(text) && row.has_tolerance() => {}
            Value::String(text) => self.number_as_text(section, row, text),
            _ => match (number_fault(row.takes, value), section) {
                (None, _) => {}
                (Some(fault), "log") => self.note(section, row.name, &format!("{fault}; it is not used")),
                (Some(fault), _) => self.wrong(section, row.name, &fault),
            },
        }
    }

    /// A text where a number belongs: nothing that the model needs may be lost in silence.
    fn number_as_text(&self, section: &str, row: &Key, text: &str) {
        let name = row.name;
        if matches!(row.need, Need::Ignored(_)) {
            let note = format!("is the text \"{text}\" and no number; it is not used ({})", row.default());
            return self.note(section, name, &note);
        }
        let remedy = match text.trim().replace(',', ".").parse::<f64>() {
            Ok(_) => format!("write {name} = {} without quotes", text.trim().replace(',', ".")),
            Err(_) if row.has_tolerance() => {
                format!("write a number, or \"{UNKNOWN}\" if you do not know it")
            }
            Err(_) => "write a number".into(),
        };
        self.wrong(section, name, &format!("must be a number, but is the text \"{text}\"; {remedy}"));
    }

    fn check_flag(&self, section: &str, row: &Key, value: &Value) {
        match (value, row.need) {
            (Value::Boolean(_), _) => {}
            (_, Need::Ignored(_)) => {
                self.note(section, row.name, "is neither true nor false; it is not used")
            }
            _ => self.wrong(section, row.name, "must be true or false, without quotes"),
        }
    }

    fn check_choice(&self, section: &str, row: &Key, text: &str, values: &[&str]) {
        if values.contains(&text) {
            return;
        }
        let listed = values.iter().map(|it| format!("\"{it}\"")).collect::<Vec<_>>().join(", ");
        let what = match (nearest(text, values.iter().copied()), values.len()) {
            (_, 1) => format!("is \"{text}\"; this program reads {listed}"),
            (Some(near), _) => {
                format!("\"{text}\" is unknown; the nearest is \"{near}\"; write one of {listed}")
            }
            (None, _) => format!("\"{text}\" is unknown; write one of {listed}"),
        };
        self.wrong(section, row.name, &what);
    }

    fn check_words(&self, section: &str, row: &Key, text: &str, values: &[&str]) {
        if let Some(near) = keys::value_meant(text, values) {
            let known = values.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
            self.wrong(section, row.name, &format!(
                "\"{text}\" is unknown; the nearest is \"{near}\"; write one of {known}, or a description in other words"
            ));
        }
    }

    /// A tolerance is relative: 0.05 is 5 %.
    fn tolerance(&self, key: &str, value: &Value, kind: Option<&str>) {
        let known = table::names("tolerance");
        if !known.contains(&key) {
            return self.unknown_key("tolerance", key, value, &known);
        }
        if let Some(fault) = number_fault(Takes::NotNegative, value) {
            return self.wrong("tolerance", key, &fault);
        }
        let number = number(value).unwrap_or(0.0);
        if number > table::WIDEST_TOLERANCE {
            let (percent, meant) = (100.0 * number, number / 100.0);
            self.note("tolerance", key, &format!(
                "= {number} is {percent:.0} %, because a tolerance is a share: write {meant:.3} for {number} %, and 1.0 for a number that is not known"
            ));
        }
        let row = table::KEYS.iter().find(|row| row.name == key);
        if let Some(kind) = kind.filter(|kind| row.is_some_and(|row| !row.read_by(kind))) {
            self.note("tolerance", key, &format!("is not used by kind = \"{kind}\""));
        }
    }
}

/// Whether a text says that a number is not known.
pub(super) fn is_unknown(text: &str) -> bool {
    text.trim().eq_ignore_ascii_case(UNKNOWN)
}

/// A number of the file, if it is one.
pub(super) fn number(value: &Value) -> Option<f64> {
    value.as_float().or(value.as_integer().map(|it| it as f64))
}

/// What is wrong with a number.
pub(super) fn number_fault(takes: Takes, value: &Value) -> Option<String> {
    match number(value) {
        None => Some("must be a number".into()),
        Some(number) if !number.is_finite() => Some("must be a finite number".into()),
        Some(number) if takes == Takes::Positive && number <= 0.0 => {
            Some(format!("is {number}; it must be greater than 0"))
        }
        Some(number) if takes == Takes::NotNegative && number < 0.0 => {
            Some(format!("is {number}; it must not be negative"))
        }
        Some(_) => None,
    }
}
