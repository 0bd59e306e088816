//! What a format of logs is: bytes in, a table of named columns out.

use super::cells::Cells;
use crate::text::input_error::InputError;
use std::io::{BufRead, Result};

/// The bytes of a log, which are opened as often as they are read.
#[derive(Clone, Copy)]
pub struct Bytes<'a> {
    /// What messages call them.
    pub name: &'a str,
    /// Opens them, from the first one on.
    pub open: &'a dyn Fn() -> Result<Box<dyn BufRead + 'a>>,
    /// Formats besides those that the engine knows.
    pub sources: &'a [&'a dyn Source],
}

/// A format of logs.
pub trait Source: Sync {
    /// Is a file of this format? `head`: its first bytes.
    fn takes(&self, name: &str, head: &[u8]) -> bool;

    /// The table that the bytes hold.
    fn table(&self, bytes: Bytes) -> std::result::Result<Cells, InputError>;
}
