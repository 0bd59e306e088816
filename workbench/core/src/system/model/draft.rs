//! A model file some of whose numbers are not known: absent, or `"unknown"`.

use super::Model;
use super::table::{self, UNKNOWN};
use crate::text::input_error::InputError;

/// A model file as it was read. Numbers of the base that nobody knows are not numbers in it, so that it cannot be simulated
/// before it is [`complete`](Self::complete).
#[derive(Clone, Debug)]
pub struct Draft {
    pub(super) model: Model,
    pub(super) unknown: Vec<Unknown>,
}

/// A number of the base that is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unknown {
    /// Its key.
    pub key: &'static str,
    /// The line of its section, or of the key where it stands as `"unknown"`; 0: neither is in the file.
    pub line: u64,
    /// The key stands in the file with the value `"unknown"`.
    pub stated: bool,
}

impl Draft {
    /// What the file states besides the base: supply, sensors, tolerances, texts.
    pub fn stated(&self) -> &Model {
        &self.model
    }

    /// The numbers of the base that are not known, in the order of the file's table.
    pub fn unknown(&self) -> &[Unknown] {
        &self.unknown
    }

    /// A number of the base, if it is known.
    pub fn number(&self, key: &str) -> Option<f64> {
        let parameters = self.model.parameters();
        parameters.into_iter().find(|(name, value)| *name == key && value.is_finite()).map(|(_, value)| value)
    }

    /// The model, for whoever has no log to fit what is unknown: every unknown number is told.
    pub fn complete(self) -> Result<Model, InputError> {
        let complaint = |unknown: &Unknown| {
            let section =
                table::KEYS.iter().find(|row| row.name == unknown.key).map_or("motor", |row| row.section);
            let beside = match unknown.key {
                "Kt_nm_per_a" => " (or Ke_vs_per_rad)",
                "inertia_kgm2" => " (or mass_kg)",
                _ => "",
            };
            let state = if unknown.stated { format!("is \"{UNKNOWN}\"") } else { "is missing".to_owned() };
            let what = format!(
                "[{section}] {}{beside} {state}; add it with its SI value (`truing gap` fits it to the log)",
                unknown.key
            );
            InputError::line(&self.model.source, unknown.line, what)
        };
        InputError::all(self.unknown.iter().map(complaint).collect())?;
        Ok(self.model)
    }
}
