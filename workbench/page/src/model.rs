//! A model before any log is asked.

use truing_core::system::model;
use wasm_bindgen::prelude::{JsError, wasm_bindgen};

/// The keys of the numbers that a model leaves open; an error if it is no model.
#[wasm_bindgen]
pub fn unknown(name: &str, text: &str) -> Result<Vec<String>, JsError> {
    let draft = model::parse_draft(name, text)?;
    Ok(draft.unknown().iter().map(|unknown| unknown.key.to_owned()).collect())
}
