//! What a caller gives for a log: a file, or a table in memory.

use arrow_array::RecordBatch;
use pyo3::prelude::*;
use pyo3_arrow::PyTable;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use truing_core::system::log::cells::Cells;
use truing_core::system::log::look::{Look, look};
use truing_core::system::log::{self, Bytes, Columns, Log, Reading, Source};
use truing_core::text::input_error::InputError;

/// A log as it comes from Python.
#[derive(FromPyObject)]
pub enum Given {
    /// A word: the name is that of a file.
    #[pyo3(transparent)]
    File(#[expect(dead_code, reason = "the name says it")] String),
    /// A table behind the Arrow C stream: pandas, Polars, pyarrow. Nothing is copied on the way.
    #[pyo3(transparent)]
    Stream(PyTable),
    /// Names and numbers.
    #[pyo3(transparent)]
    Columns(Vec<(String, Vec<f64>)>),
}

/// Logs by the names that messages use.
#[derive(Default)]
pub struct Logs(BTreeMap<PathBuf, Table>);

/// A table in memory.
enum Table {
    Stream(Vec<RecordBatch>),
    Columns(Vec<(String, Vec<f64>)>),
}

impl Logs {
    /// Those that are no files.
    pub fn of(given: Vec<(String, Given)>) -> Self {
        let table = |(name, given): (String, Given)| match given {
            Given::File(_) => None,
            Given::Stream(table) => Some((name.into(), Table::Stream(table.into_inner().0))),
            Given::Columns(columns) => Some((name.into(), Table::Columns(columns))),
        };
        Self(given.into_iter().filter_map(table).collect())
    }

    /// Reads a log, and says how it was read.
    pub fn open(&self, path: &Path, columns: &Columns) -> Result<Reading, InputError> {
        match self.0.get(path) {
            Some(table) => table.bytes(path, |bytes| log::reading(bytes, columns)),
            None => truing_files::log::open(path, columns),
        }
    }

    /// Reads a record that need not have an output.
    pub fn input(&self, path: &Path, columns: &Columns) -> Result<Log, InputError> {
        match self.0.get(path) {
            Some(table) => table.bytes(path, |bytes| log::input(bytes, columns)).map(|reading| reading.log),
            None => truing_files::log::read_input(path, columns),
        }
    }

    /// Looks at a log.
    pub fn look(&self, path: &Path, columns: &Columns) -> Result<Look, InputError> {
        match self.0.get(path) {
            Some(table) => table.bytes(path, |bytes| look(bytes, columns)),
            None => truing_files::log::look(path, columns),
        }
    }
}

impl Table {
    /// As the bytes of a format that this table alone is of.
    fn bytes<T>(&self, path: &Path, read: impl Fn(Bytes) -> Result<T, InputError>) -> Result<T, InputError> {
        let name = path.display().to_string();
        read(Bytes { name: &name, open: &|| Ok(Box::new(&[][..])), sources: &[self] })
    }
}

impl Source for Table {
    fn takes(&self, _: &str, _: &[u8]) -> bool {
        true
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let cells = match self {
            Self::Stream(batches) => truing_formats::arrow::cells(batches),
            Self::Columns(columns) => truing_formats::columns(columns.clone()),
        };
        cells.map_err(|what| InputError::file(bytes.name, what))
    }
}
