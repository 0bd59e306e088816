//! The rows of a text with the lines on which they begin.

use super::layout::Layout;
use super::stream::{Joined, Text};
use super::text::{comment, split};
use crate::text::input_error::InputError;

/// Rows of a text, one at a time.
pub struct Records<'a> {
    source: &'a str,
    lines: Joined<'a>,
    layout: &'a Layout,
}

/// One row: its cells, and the line on which it begins.
#[derive(Default)]
pub struct Record {
    /// Number of the line.
    pub line: u64,
    /// The line has its end.
    pub ended: bool,
    cells: Vec<String>,
}

impl Record {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// A cell without the blanks around it; empty where the row has fewer.
    pub fn cell(&self, index: usize) -> &str {
        self.cells.get(index).map_or("", String::as_str)
    }

    /// All cells, without the blanks around them.
    pub fn cells(&self) -> impl DoubleEndedIterator<Item = &str> {
        self.cells.iter().map(String::as_str)
    }

    /// Other cells.
    pub fn set<'c>(&mut self, cells: impl Iterator<Item = &'c str>) {
        self.cells.clear();
        self.cells.extend(cells.map(str::to_owned));
    }
}

impl<'a> Records<'a> {
    /// From the first row of a layout on.
    pub fn of(source: &'a str, text: &'a Text, layout: &'a Layout) -> Result<Self, InputError> {
        let lines = Joined::of(text).map_err(|error| InputError::file(source, error))?;
        Ok(Self { source, lines, layout })
    }

    /// Reads the next row that holds something. False: there is none.
    pub fn read(&mut self, row: &mut Record) -> Result<bool, InputError> {
        while let Some(line) = self.lines.next().map_err(|error| InputError::file(self.source, error))? {
            if line.trim().is_empty() || comment(line).is_some() {
                continue;
            }
            row.set(split(&self.layout.rewritten(line), self.layout.separator).into_iter());
            (row.line, row.ended) = (self.lines.number, self.lines.ended);
            if row.line >= self.layout.first && row.cells().any(|cell| !cell.is_empty()) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}
