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
    /// All cells, without the blanks around them.
    pub cells: Vec<String>,
}

impl Record {
    /// A cell without the blanks around it; empty where the row has fewer.
    pub fn cell(&self, index: usize) -> &str {
        self.cells.get(index).map_or("", String::as_str)
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
            row.cells.clear();
            let cells = self.layout.rewritten(line);
            row.cells.extend(split(&cells, self.layout.separator).into_iter().map(str::to_owned));
            (row.line, row.ended) = (self.lines.number, self.lines.ended);
            if row.line >= self.layout.first && !row.cells.iter().all(String::is_empty) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}
