//! The text of a model file, and what is wrong with it: every complaint names section, key and line.

use super::keys::{self, KINDS, SECTIONS};
use crate::console::input_error::{InputError, nearest};
use toml::{Table, Value};

/// The file, for messages.
pub(super) struct File<'a> {
    pub(super) source: &'a str,
    pub(super) text: &'a str,
}

impl File<'_> {
    pub(super) fn syntax(&self, error: &toml::de::Error) -> InputError {
        let before = error.span().map_or(0, |span| span.start.min(self.text.len()));
        let line = self.text[..before].matches('\n').count() as u64 + 1;
        InputError::line(
            self.source,
            line,
            format!("is not valid TOML: {}", error.message().replace('\n', " ")),
        )
    }

    /// The line of `key` in `[section]`, from the text; 0 when it is not there.
    fn line_of(&self, section: &str, key: &str) -> u64 {
        let mut current = String::new();
        for (index, line) in self.text.lines().map(str::trim).enumerate() {
            if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.split(']').next()) {
                current = name.trim().to_owned();
                if current == section && key.is_empty() {
                    return index as u64 + 1;
                }
            }
            let name = line.split('=').next().unwrap_or("").trim().trim_matches('"');
            if current == section && name == key && !key.is_empty() {
                return index as u64 + 1;
            }
        }
        0
    }

    pub(super) fn wrong(&self, section: &str, key: &str, what: &str) -> InputError {
        let place = if section.is_empty() { key.to_owned() } else { format!("[{section}] {key}") };
        match self.line_of(section, key) {
            0 => InputError::file(self.source, format!("{place} {what}")),
            line => InputError::line(self.source, line, format!("{place} {what}")),
        }
    }

    pub(super) fn schema(&self, root: &Table) -> Result<(), InputError> {
        match root.get("schema").and_then(Value::as_str) {
            Some("truing-model/1") => Ok(()),
            Some(other) => Err(self.wrong(
                "",
                "schema",
                &format!("is \"{other}\"; this program reads \"truing-model/1\""),
            )),
            None => {
                Err(self.wrong("", "schema", "is missing; begin the file with schema = \"truing-model/1\""))
            }
        }
    }

    /// Every key is known, or a text that is no typing error of a known one.
    pub(super) fn sections(&self, root: &Table) -> Result<(), InputError> {
        let mut complaints = Vec::new();
        for (name, value) in root {
            match (value, SECTIONS.iter().find(|section| section.0 == name)) {
                (Value::Table(table), Some((_, keys))) => complaints.extend(self.keys(name, table, keys)),
                (Value::Table(_), None) if name == "known" => {}
                (Value::Table(table), None) => complaints.extend(self.other_section(name, table)),
                (Value::String(text), _) => complaints.extend(self.text_outside(name, text)),
                (Value::Boolean(_), _) if name == "fitted_to_log" => {}
                _ => complaints.push(self.wrong(
                    "",
                    name,
                    "is no known key outside a section; move it into one ([motor], [tolerance], …)",
                )),
            }
        }
        InputError::all(complaints)
    }

    /// A section of one's own holds texts alone.
    fn other_section(&self, name: &str, table: &Table) -> Option<InputError> {
        let known = || SECTIONS.iter().map(|section| section.0).chain(["known"]);
        let near = match table.values().all(Value::is_str) {
            true => keys::meant(name, known())?,
            false => nearest(name, known()).unwrap_or("motor"),
        };
        Some(self.wrong(name, "", &format!("is no known section; the nearest is [{near}]")))
    }

    fn text_outside(&self, name: &str, text: &str) -> Option<InputError> {
        if name == "kind" && KINDS.contains(&text) {
            return Some(self.wrong("", name, "stands outside a section; move it under [model]"));
        }
        self.mistyped("", name, &[])
    }

    fn mistyped(&self, section: &str, key: &str, numbers: &[&str]) -> Option<InputError> {
        let known = numbers.iter().chain(keys::texts(section)).copied();
        let near = keys::meant(key, known)?;
        Some(self.wrong(section, key, &format!("is no known key; the nearest is {near}")))
    }

    /// `numbers`: the keys that are known besides the texts.
    pub(super) fn keys(&self, section: &str, table: &Table, numbers: &[&str]) -> Vec<InputError> {
        let complaint = |(key, value): (&String, &Value)| match value {
            Value::String(text) if key == "kind" && section == "motor" && KINDS.contains(&text.as_str()) => {
                Some(self.wrong(section, key, "stands in the wrong section; move it under [model]"))
            }
            Value::String(_) => self.mistyped(section, key, numbers),
            _ if numbers.contains(&key.as_str()) => None,
            _ if keys::texts(section).contains(&key.as_str()) => {
                Some(self.wrong(section, key, "must be a text in quotes"))
            }
            _ => {
                let known = match nearest(key, numbers.iter().copied()) {
                    Some(near) => format!("the nearest is {near}"),
                    None => format!("the known ones are {}", numbers.join(", ")),
                };
                Some(self.wrong(section, key, &format!("is no known key; {known}")))
            }
        };
        table.iter().filter_map(complaint).collect()
    }
}
