//! The rows of a text with the lines on which they begin.

use super::layout::Layout;
use super::stream::{CHUNK, Lines, Text};
use super::text::is_comment;
use crate::console::input_error::InputError;
use std::collections::VecDeque;
use std::io::Read;

/// Rows of a text, one at a time.
pub struct Records<'a> {
    source: &'a str,
    reader: csv::Reader<Rewritten<'a>>,
}

/// One row: its cells, and the line on which it begins.
#[derive(Default)]
pub struct Record {
    /// Number of the line.
    pub line: u64,
    cells: csv::StringRecord,
}

impl Record {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// A cell without the blanks around it; empty where the row has fewer.
    pub fn cell(&self, index: usize) -> &str {
        self.cells.get(index).unwrap_or("").trim()
    }

    /// All cells, without the blanks around them.
    pub fn cells(&self) -> impl DoubleEndedIterator<Item = &str> {
        self.cells.iter().map(str::trim)
    }
}

impl<'a> Records<'a> {
    /// From the first row on.
    pub fn of(source: &'a str, text: &'a Text, layout: &'a Layout) -> Result<Self, InputError> {
        let lines = text.lines().map_err(|error| InputError::file(source, error))?;
        let rewritten =
            Rewritten { lines, layout, line: Vec::new(), at: 0, written: 0, places: VecDeque::new() };
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(layout.delimiter())
            .terminator(csv::Terminator::Any(b'\n'))
            .buffer_capacity(CHUNK)
            .from_reader(rewritten);
        Ok(Self { source, reader })
    }

    /// Reads the next row that holds something. False: there is none.
    pub fn read(&mut self, row: &mut Record) -> Result<bool, InputError> {
        loop {
            let read = self.reader.read_record(&mut row.cells);
            if !read.map_err(|error| InputError::file(self.source, error))? {
                return Ok(false);
            }
            if row.cells().any(|cell| !cell.is_empty()) {
                let written = row.cells.position().map_or(1, csv::Position::line);
                row.line = self.reader.get_mut().place(written);
                return Ok(true);
            }
        }
    }
}

/// The lines of a text, rewritten for a reader of CSV, without comments and without what is blank: the reader counts a row from
/// where it stood before lines that it skips.
struct Rewritten<'a> {
    lines: Lines<'a>,
    layout: &'a Layout,
    /// The line that is handed on, and the byte from which it still is to be.
    line: Vec<u8>,
    at: usize,
    /// Lines that were written.
    written: u64,
    /// Number of a written line and of the line of the text that it was, where the lines after it follow one by one.
    places: VecDeque<(u64, u64)>,
}

impl Rewritten<'_> {
    /// Takes the next line. False: the text is over.
    fn advance(&mut self) -> std::io::Result<bool> {
        while let Some((line, ended)) = self.lines.read()? {
            if line.trim().is_empty() || is_comment(line) {
                continue;
            }
            self.line.clear();
            self.at = 0;
            self.line.extend_from_slice(self.layout.rewritten(line).as_bytes());
            if ended {
                self.line.push(b'\n');
            }
            let (first, number) = (self.written + 1, self.lines.number);
            if self.places.back().is_none_or(|(from, place)| first - from != number - place) {
                self.places.push_back((first, number));
            }
            self.written += 1;
            // The pieces of a line that was parted are on it, too.
            for _ in 0..line_feeds(&self.line[..self.line.len() - usize::from(ended)]) {
                self.written += 1;
                self.places.push_back((self.written, number));
            }
            return Ok(true);
        }
        Ok(false)
    }

    /// The line of the text that a written line was. To be asked in increasing order.
    fn place(&mut self, written: u64) -> u64 {
        while self.places.get(1).is_some_and(|next| next.0 <= written) {
            self.places.pop_front();
        }
        self.places.front().map_or(written, |(from, place)| place + (written - from))
    }
}

fn line_feeds(bytes: &[u8]) -> usize {
    bytes.iter().filter(|byte| **byte == b'\n').count()
}

impl Read for Rewritten<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let mut filled = 0;
        while filled < buffer.len() {
            if self.at == self.line.len() && !self.advance()? {
                break;
            }
            let count = (self.line.len() - self.at).min(buffer.len() - filled);
            buffer[filled..filled + count].copy_from_slice(&self.line[self.at..self.at + count]);
            (self.at, filled) = (self.at + count, filled + count);
        }
        Ok(filled)
    }
}
