//! Opens a log: from a file, a text or bytes.

use super::cells::Cells;
use super::columns::Columns;
use super::read::Sheet;
use super::stream::{Text, source_of};
use super::{Log, Reading};
use crate::text::input_error::InputError;
use std::path::Path;

/// Reads a log from a file.
pub fn read(path: &Path, columns: &Columns) -> Result<Log, InputError> {
    open(path, columns).map(|reading| reading.log)
}

/// Reads a log from a file, and says how it was read.
pub fn open(path: &Path, columns: &Columns) -> Result<Reading, InputError> {
    let source = source_of(path);
    Sheet::open(&source, cells(path)?, columns, true)
}

/// Reads a record that need not have an output: what a simulation is driven by.
pub fn read_input(path: &Path, columns: &Columns) -> Result<Log, InputError> {
    let source = source_of(path);
    Sheet::open(&source, cells(path)?, columns, false).map(|reading| reading.log)
}

/// Reads a log from a text; `source` names it in messages.
pub fn parse(source: &str, text: &str, columns: &Columns) -> Result<Log, InputError> {
    parse_bytes(source, text.as_bytes(), columns).map(|reading| reading.log)
}

/// Reads a log from the bytes of a file; `source` names it in messages.
pub fn parse_bytes(source: &str, bytes: &[u8], columns: &Columns) -> Result<Reading, InputError> {
    let (text, encoding) = Text::of_bytes(source, bytes)?;
    Sheet::open(source, Cells::read(source, &text, encoding)?, columns, true)
}

/// The table that a file holds.
pub(super) fn cells(path: &Path) -> Result<Cells, InputError> {
    let source = source_of(path);
    let (text, encoding) = Text::of_file(&source, path)?;
    Cells::read(&source, &text, encoding)
}
