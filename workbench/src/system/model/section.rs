//! One section of a model file: its numbers, texts and flags within their ranges, and the effects under `[known.…]`.

use super::Known;
use super::file::File;
use crate::console::input_error::InputError;
use crate::system::effects::{self, Effect};
use toml::{Table, Value};

/// The table, with what messages need.
pub(super) struct Section<'a> {
    pub(super) file: &'a File<'a>,
    pub(super) name: String,
    pub(super) table: Table,
}

impl Section<'_> {
    /// Reads an effect's parameters and their standard deviations.
    pub(super) fn known(&self, effect: &'static Effect, linear: bool) -> Result<Known, InputError> {
        let key = |name: &str| {
            if linear && !self.table.contains_key(name) { effects::linear_key(name) } else { name.to_owned() }
        };
        let names: Vec<String> = effect.parameters.iter().map(|parameter| key(parameter.name)).collect();
        let mut allowed: Vec<String> = names.clone();
        allowed.extend(names.iter().map(|name| format!("{name}_std")));
        let allowed: Vec<&str> = allowed.iter().map(String::as_str).collect();
        InputError::all(self.file.keys(&self.name, &self.table, &allowed))?;
        let mut values = Vec::new();
        for (parameter, name) in effect.parameters.iter().zip(&names) {
            values.push(match (self.number(name)?, parameter.default) {
                (Some(value), _) => self.allowed(name, value, parameter.lower)?,
                (None, Some(default)) => default,
                (None, None) => {
                    return Err(self.file.wrong(
                        &self.name,
                        name,
                        &format!("is missing; {} needs it", effect.name),
                    ));
                }
            });
        }
        let stds =
            names.iter().map(|name| self.not_negative(&format!("{name}_std"))).collect::<Result<_, _>>()?;
        Ok(Known { effect, values, stds, origin: self.text("origin")? })
    }

    /// A magnitude must not be negative.
    pub(super) fn allowed(&self, key: &str, value: f64, lower: f64) -> Result<f64, InputError> {
        if lower >= 0.0 && value < 0.0 {
            return Err(self.wrong(key, &format!("is {value}; it is a magnitude and must not be negative")));
        }
        Ok(value)
    }

    pub(super) fn wrong(&self, key: &str, what: &str) -> InputError {
        self.file.wrong(&self.name, key, what)
    }

    pub(super) fn number(&self, key: &str) -> Result<Option<f64>, InputError> {
        let value = match self.table.get(key) {
            None => return Ok(None),
            Some(Value::Float(value)) => *value,
            Some(Value::Integer(value)) => *value as f64,
            Some(_) => return Err(self.wrong(key, "must be a number")),
        };
        if value.is_finite() { Ok(Some(value)) } else { Err(self.wrong(key, "must be a finite number")) }
    }

    pub(super) fn positive_or_none(&self, key: &str) -> Result<Option<f64>, InputError> {
        match self.number(key)? {
            Some(value) if value <= 0.0 => {
                Err(self.wrong(key, &format!("is {value}; it must be greater than 0")))
            }
            other => Ok(other),
        }
    }

    pub(super) fn positive(&self, key: &str) -> Result<f64, InputError> {
        self.positive_or_none(key)?.ok_or_else(|| self.wrong(key, "is missing; add it with its SI value"))
    }

    pub(super) fn not_negative(&self, key: &str) -> Result<Option<f64>, InputError> {
        match self.number(key)? {
            Some(value) if value < 0.0 => {
                Err(self.wrong(key, &format!("is {value}; it must not be negative")))
            }
            other => Ok(other),
        }
    }

    pub(super) fn text(&self, key: &str) -> Result<Option<String>, InputError> {
        match self.table.get(key) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text.clone())),
            Some(_) => Err(self.wrong(key, "must be a text in quotes")),
        }
    }

    pub(super) fn flag(&self, key: &str) -> Result<Option<bool>, InputError> {
        match self.table.get(key) {
            None | Some(Value::String(_)) => Ok(None),
            Some(Value::Boolean(value)) => Ok(Some(*value)),
            Some(_) => Err(self.wrong(key, "must be true or false")),
        }
    }
}
