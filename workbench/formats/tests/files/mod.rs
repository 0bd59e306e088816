//! The files of `tests/reference`, read as the command line reads them.
#![allow(dead_code)]

use truing_core::system::log::cells::Cells;
use truing_core::system::log::{Bytes, Source};
use truing_formats::SOURCES;

pub const REFERENCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference");

/// All files of a format.
pub fn names() -> Vec<String> {
    let files = std::fs::read_dir(REFERENCE).unwrap();
    let mut names: Vec<String> = files
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .filter(|name| taker(name).is_some())
        .collect();
    names.sort();
    assert!(names.len() > 25, "{names:?}");
    names
}

pub fn contents(name: &str) -> Vec<u8> {
    std::fs::read(format!("{REFERENCE}/{name}")).unwrap()
}

/// The format that takes a file.
pub fn taker(name: &str) -> Option<&'static dyn Source> {
    let bytes = contents(name);
    let head = &bytes[..bytes.len().min(4096)];
    SOURCES.iter().find(|source| source.takes(name, head)).copied()
}

pub fn cells(name: &str) -> Cells {
    table(taker(name).unwrap(), name, &contents(name)).unwrap()
}

/// The table in these bytes, or what is said of them.
pub fn table(source: &dyn Source, name: &str, bytes: &[u8]) -> Result<Cells, String> {
    source.table(Bytes { name, open: &|| Ok(Box::new(bytes)), sources: SOURCES }).map_err(|error| error.0)
}
