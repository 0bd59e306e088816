//! Opens a log: the list of formats, and the way from bytes to a log.

use super::cells::Cells;
use super::clock::Form;
use super::columns::Columns;
use super::json::Json;
use super::read::Sheet;
use super::source::{Bytes, Source};
use super::text_table::TextTable;
use super::{Log, Reading};
use crate::text::input_error::InputError;
use std::io::Read;

/// The formats that need nothing. The first one that takes a file reads it; what none takes is a text.
const SOURCES: [&dyn Source; 1] = [&Json];
/// Bytes by which a format is recognised. Chosen by judgement; not studied.
const HEAD: u64 = 4096;

/// Reads a log, and says how it was read.
pub fn reading(bytes: Bytes, columns: &Columns) -> Result<Reading, InputError> {
    Sheet::open(bytes.name, cells(bytes)?, columns, true)
}

/// Reads a record that need not have an output: what a simulation is driven by.
pub fn input(bytes: Bytes, columns: &Columns) -> Result<Reading, InputError> {
    Sheet::open(bytes.name, cells(bytes)?, columns, false)
}

/// Reads a log from a text; `source` names it in messages.
pub fn parse(source: &str, text: &str, columns: &Columns) -> Result<Log, InputError> {
    parse_bytes(source, text.as_bytes(), columns).map(|reading| reading.log)
}

/// Reads a log from the bytes of a file; `source` names it in messages.
pub fn parse_bytes(source: &str, bytes: &[u8], columns: &Columns) -> Result<Reading, InputError> {
    reading(Bytes { name: source, open: &|| Ok(Box::new(bytes)), sources: &[] }, columns)
}

/// The table that the bytes hold.
pub(super) fn cells(bytes: Bytes) -> Result<Cells, InputError> {
    let mut head = Vec::new();
    let read = (bytes.open)().and_then(|reader| reader.take(HEAD).read_to_end(&mut head));
    read.map_err(|error| InputError::unreadable(bytes.name, error))?;
    let taken = bytes.sources.iter().chain(&SOURCES).find(|source| source.takes(bytes.name, &head));
    let mut cells = taken.map_or_else(|| TextTable.table(bytes), |source| source.table(bytes))?;
    for (unit, column) in cells.units.iter_mut().zip(&cells.columns) {
        if let Some(Form::Unit(written)) = &column.form {
            unit.get_or_insert_with(|| written.clone());
        }
    }
    Ok(cells)
}
