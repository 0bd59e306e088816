//! The files that the workbench reads. The core is given bytes and texts, and knows no path.
//!
//! The modules hold what those of the core hold, and besides what reads a file.

#![deny(clippy::print_stdout, clippy::print_stderr)]

pub mod log;
pub mod model;

use std::path::Path;
use truing_core::text::input_error::InputError;

/// The text of a file, or that there is none.
pub fn text(path: &Path) -> Result<String, InputError> {
    std::fs::read_to_string(path).map_err(|error| InputError::unreadable(path.display(), error))
}
