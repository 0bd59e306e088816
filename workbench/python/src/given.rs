//! What a caller gives for a log: a file, or a table in memory.

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

/// Logs in memory by the names that messages use.
pub struct Logs(BTreeMap<PathBuf, Given>);

impl Logs {
    /// Those that are no files.
    pub fn of(given: Vec<(String, Given)>) -> Self {
        let tables = given.into_iter().filter(|(_, given)| !matches!(given, Given::File(_)));
        Self(tables.map(|(name, table)| (name.into(), table)).collect())
    }

    /// Reads a log, and says how it was read.
    pub fn open(&self, path: &Path, columns: &Columns) -> Result<Reading, InputError> {
        self.or_file(path, |bytes| log::reading(bytes, columns), || truing_files::log::open(path, columns))
    }

    /// Reads a record that need not have an output.
    pub fn input(&self, path: &Path, columns: &Columns) -> Result<Log, InputError> {
        let table = |bytes: Bytes| log::input(bytes, columns).map(|reading| reading.log);
        self.or_file(path, table, || truing_files::log::read_input(path, columns))
    }

    /// Looks at a log.
    pub fn look(&self, path: &Path, columns: &Columns) -> Result<Look, InputError> {
        self.or_file(path, |bytes| look(bytes, columns), || truing_files::log::look(path, columns))
    }

    /// A table as the bytes of a format that it alone is of, or a file.
    fn or_file<T>(
        &self,
        path: &Path,
        table: impl Fn(Bytes) -> Result<T, InputError>,
        file: impl Fn() -> Result<T, InputError>,
    ) -> Result<T, InputError> {
        let Some(given) = self.0.get(path) else { return file() };
        let name = path.display().to_string();
        table(Bytes { name: &name, open: &|| Ok(Box::new(&[][..])), sources: &[given] })
    }
}

impl Source for Given {
    fn takes(&self, _: &str, _: &[u8]) -> bool {
        true
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let cells = match self {
            Self::File(_) => Err("a file is no table in memory".into()),
            Self::Stream(table) => truing_formats::arrow::cells(table.batches()),
            Self::Columns(columns) => truing_formats::columns(columns.clone()),
        };
        cells.map_err(|what| InputError::file(bytes.name, what))
    }
}
