//! One section of a model file: its numbers, texts and flags within their ranges, and the effects under `[known.…]`. What is
//! wrong is collected by the file.

use super::Known;
use super::complaints::File;
use super::file::{number, number_fault};
use super::table::Takes;
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
    pub(super) fn known(&self, effect: &'static Effect, linear: bool) -> Known {
        let key = |name: &str| {
            if linear && !self.table.contains_key(name) { effects::linear_key(name) } else { name.to_owned() }
        };
        let names: Vec<String> = effect.parameters.iter().map(|parameter| key(parameter.name)).collect();
        let stds: Vec<String> = names.iter().map(|name| format!("{name}_std")).collect();
        let allowed: Vec<&str> = names.iter().chain(&stds).map(String::as_str).collect();
        self.file.check_effect(&self.name, &self.table, &allowed);
        let parameters = effect.parameters.iter().zip(&names);
        let value = |(parameter, name): (&effects::Parameter, &String)| match self.table.get(name) {
            Some(value) => self.parameter(name, value, parameter.lower),
            None => parameter.default.unwrap_or_else(|| {
                self.file.missing(&self.name, name, &format!("{} needs it", effect.name));
                0.0
            }),
        };
        Known {
            effect,
            values: parameters.map(value).collect(),
            stds: stds.iter().map(|name| self.not_negative(name)).collect(),
            origin: self.text("origin"),
        }
    }

    /// A magnitude must not be negative.
    fn parameter(&self, key: &str, value: &Value, lower: f64) -> f64 {
        if let Some(fault) = number_fault_of_any(value) {
            self.wrong(key, fault);
        }
        let value = number(value).unwrap_or(0.0);
        if lower >= 0.0 && value < 0.0 {
            self.wrong(key, &format!("is {value}; it is a magnitude and must not be negative"));
        }
        value
    }

    pub(super) fn wrong(&self, key: &str, what: &str) {
        self.file.wrong(&self.name, key, what);
    }

    /// The same, where nothing can be made of the key.
    pub(super) fn refused<T>(&self, key: &str, what: &str) -> Option<T> {
        self.wrong(key, what);
        None
    }

    /// A number of at least 0.
    fn not_negative(&self, key: &str) -> Option<f64> {
        let value = self.table.get(key)?;
        if let Some(fault) = number_fault(Takes::NotNegative, value) {
            self.wrong(key, &fault);
        }
        number(value)
    }

    /// A number greater than 0 that must be there.
    pub(super) fn positive(&self, key: &str) -> Option<f64> {
        let Some(value) = self.table.get(key) else {
            self.file.missing(&self.name, key, "add it with its SI value");
            return None;
        };
        if let Some(fault) = number_fault(Takes::Positive, value) {
            self.wrong(key, &fault);
        }
        number(value)
    }

    /// A number that the check of the keys has let pass.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        self.table.get(key).and_then(number).filter(|it| it.is_finite())
    }

    /// A text that the check of the keys has let pass.
    pub(super) fn text(&self, key: &str) -> Option<String> {
        self.table.get(key).and_then(Value::as_str).map(str::to_owned)
    }

    /// A switch that the check of the keys has let pass.
    pub(super) fn flag(&self, key: &str) -> Option<bool> {
        self.table.get(key).and_then(Value::as_bool)
    }
}

/// What is wrong with a number that may have either sign.
fn number_fault_of_any(value: &Value) -> Option<&'static str> {
    match number(value) {
        None => Some("must be a number"),
        Some(number) if !number.is_finite() => Some("must be a finite number"),
        Some(_) => None,
    }
}
