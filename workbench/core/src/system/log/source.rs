//! What a format of logs is: bytes in, a table of named columns out.

use super::cells::Cells;
use crate::text::input_error::InputError;
use std::io::{BufRead, Result};

/// The bytes of a log, which are read as often as it is needed.
pub trait Bytes {
    /// What messages call them.
    fn name(&self) -> &str;

    /// From the first one on.
    fn open(&self) -> Result<Box<dyn BufRead + '_>>;
}

/// Bytes in memory.
pub struct Held<'a> {
    /// What messages call them.
    pub name: &'a str,
    /// All of them.
    pub bytes: &'a [u8],
}

impl Bytes for Held<'_> {
    fn name(&self) -> &str {
        self.name
    }

    fn open(&self) -> Result<Box<dyn BufRead + '_>> {
        Ok(Box::new(self.bytes))
    }
}

/// A format of logs.
pub trait Source: Sync {
    /// Is a file of this format? `head`: its first bytes.
    fn takes(&self, name: &str, head: &[u8]) -> bool;

    /// The table that the bytes hold.
    fn table(&self, bytes: &dyn Bytes) -> std::result::Result<Cells, InputError>;
}
