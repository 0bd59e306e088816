//! Models in files.

pub use truing_core::system::model::*;

use std::path::Path;
use truing_core::text::input_error::InputError;

/// Reads a model from a file.
pub fn read(path: &Path) -> Result<Model, InputError> {
    read_draft(path)?.complete()
}

/// Reads a model of which numbers may be unknown from a file.
pub fn read_draft(path: &Path) -> Result<Draft, InputError> {
    let source = path.display().to_string();
    let text =
        crate::text(path).map_err(|error| InputError(error.0 + ", or write one with `truing start`"))?;
    parse_draft(&source, &text)
}
