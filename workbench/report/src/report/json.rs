//! JSON, schema `truing-gap/1`.

use super::Exporter;
use anyhow::{Context, Result};
use truing_core::outcome::Outcome;

/// Writes the serialised part of the outcome, indented, keys in the order of the schema.
pub struct Json;

impl Exporter for Json {
    fn export(&self, outcome: &Outcome) -> Result<String> {
        Ok(serde_json::to_string_pretty(outcome).context("the outcome cannot be serialised")? + "\n")
    }
}
