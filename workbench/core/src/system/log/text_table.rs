//! A table as text, in whatever dialect.

use super::cells::{Cells, Column, Place};
use super::dialect::Dialect;
use super::layout::Layout;
use super::records::{Record, Records};
use super::source::{Bytes, Source};
use super::stream::Text;
use super::text::{is_value, missing};
use crate::text::input_error::InputError;

/// Text: what loggers, spreadsheets and serial monitors write.
pub struct TextTable;

impl Source for TextTable {
    fn takes(&self, _: &str, _: &[u8]) -> bool {
        true
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let (source, (text, encoding)) = (bytes.name, Text::of(bytes)?);
        let (layout, head, dialect) = Layout::of(source, &text, encoding)?;
        let mut records = Records::of(source, &text, &layout)?;
        let cells = Cells {
            columns: vec![Column::default(); head.names.len()],
            header: head.names,
            units: head.units,
            head: Place { what: "line", number: head.line },
            ..Cells::default()
        };
        let rows = Rows { source, cells, dialect, last: Last::default(), damage: Vec::new() };
        let (mut cells, dialect) = rows.read(&mut records)?;
        if dialect.topics {
            cells.sort_by_time();
        }
        (cells.written, cells.told) = (dialect.written(), dialect.sentence());
        Ok(Cells { dialect: Some(dialect), ..cells })
    }
}

/// A table has so many rows, or more of them than lines without a number. Chosen by judgement; not studied.
const LEAST: usize = 3;

/// Rows as they are taken.
struct Rows<'a> {
    source: &'a str,
    cells: Cells,
    dialect: Dialect,
    last: Last,
    /// Line and number of cells of rows with too few or too many.
    damage: Vec<(u64, usize)>,
}

/// What was seen of the last column.
#[derive(Default)]
struct Last {
    /// Decimals of its first cell.
    first: Option<usize>,
    /// Decimals of its latest cell.
    latest: Option<usize>,
    /// Some cell has others.
    differ: bool,
}

impl Rows<'_> {
    /// Takes the rows; a last one that was cut is left out, any other damage is an error.
    fn read(mut self, records: &mut Records) -> Result<(Cells, Dialect), InputError> {
        let (mut row, mut next, mut begun) = (Record::default(), Record::default(), false);
        let mut more = records.read(&mut row)?;
        while more {
            more = records.read(&mut next)?;
            self.take(&mut row, begun && !more);
            begun = true;
            std::mem::swap(&mut row, &mut next);
        }
        match self.damage.first() {
            None if self.cells.rows >= LEAST => Ok((self.cells, self.dialect)),
            // Where no row fits the header, there is a table below a header that does not.
            _ if self.cells.rows > 0 && self.dialect.words + self.damage.len() > self.cells.rows => {
                Err(self.no_table())
            }
            None => Ok((self.cells, self.dialect)),
            Some(&(line, cells)) => Err(self.broken_rows(line, cells)),
        }
    }

    fn take(&mut self, row: &mut Record, last: bool) {
        let width = self.cells.header.len();
        let fits = |row: &Record| {
            row.cells.len() == width || row.cells.len() == width + 1 && row.cell(width).is_empty()
        };
        if row.cells.len() > width
            && !fits(row)
            && self.dialect.separator == ','
            && join_thousands(row, width)
        {
            self.dialect.thousands += 1;
        }
        if row.cells == self.cells.header {
            self.cells.restarts.push(self.cells.rows);
        } else if !row.cells.iter().any(|cell| is_value(cell)) && !row.cells.iter().all(|cell| missing(cell))
        {
            self.dialect.words += 1;
        } else if last && (row.cells.len() < width || !row.ended && self.is_cut(row)) {
            self.dialect.cut = Some(row.line);
        } else if fits(row) {
            self.last.see(self.dialect.decimals(row.cell(width - 1)), self.cells.rows == 0);
            self.cells.push(row.line, |index| row.cell(index), &self.dialect);
        } else {
            self.damage.push((row.line, row.cells.len()));
        }
    }

    /// A last line without an end: its last cell is no number, or lacks decimals that every other number of the column has.
    fn is_cut(&self, row: &Record) -> bool {
        match self.dialect.decimals(row.cell(self.cells.header.len() - 1)) {
            None => self.last.latest.is_some(),
            Some(own) => !self.last.differ && self.last.first.is_some_and(|first| first > own),
        }
    }

    /// A text with a few rows of numbers somewhere in it.
    fn no_table(&self) -> InputError {
        let (rows, others) = (self.cells.rows, self.dialect.words + self.damage.len());
        let what = format!(
            "is no table: {rows} of its lines hold as many numbers as the first one, {others} do not; export the log as CSV"
        );
        InputError::file(self.source, what)
    }

    fn broken_rows(&self, line: u64, cells: usize) -> InputError {
        let (width, others) = (self.cells.header.len(), self.damage.len() - 1);
        let commas = self.dialect.separator == ',' && cells > width;
        let more = match (others, self.damage.get(1)) {
            (1, Some((other, _))) => format!(" (line {other} too)"),
            (_, Some((next, _))) => format!(" ({others} further rows too, the next is line {next})"),
            _ => String::new(),
        };
        let why = if commas && others >= self.cells.rows {
            "; if commas are decimal signs here, export the table with semicolons or tabs between the cells"
                .into()
        } else if commas && self.dialect.thousands > 0 {
            ": a comma between thousands is also what parts the cells, and this row can be read in several ways; export the table \
             without signs between the thousands, or with semicolons"
                .into()
        } else {
            format!("{more}; the file is truncated or damaged, remove the row")
        };
        let what = format!("has {cells} cells where the header has {width}{why}");
        InputError::line(self.source, line, what)
    }
}

/// Puts numbers together that were parted at their thousands, where that can be done in one way alone: `1,234.50`.
fn join_thousands(row: &mut Record, width: usize) -> bool {
    let cells = &row.cells;
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let goes_on = |k: usize| {
        let (before, whole) =
            (cells[k - 1].trim_start_matches(['-', '+']), cells[k].split('.').next().unwrap_or(""));
        digits(before) && before.len() <= 3 && digits(whole) && whole.len() == 3
    };
    let parted: Vec<usize> = (1..cells.len()).filter(|k| goes_on(*k)).collect();
    if parted.len() != cells.len() - width {
        return false;
    }
    let mut joined: Vec<String> = Vec::new();
    for (k, cell) in cells.iter().enumerate() {
        match joined.last_mut().filter(|_| parted.contains(&k)) {
            Some(number) => number.push_str(cell),
            None => joined.push(cell.clone()),
        }
    }
    row.cells = joined;
    true
}

impl Last {
    fn see(&mut self, decimals: Option<usize>, first: bool) {
        if first {
            self.first = decimals;
        }
        self.differ |= decimals != self.first;
        self.latest = decimals;
    }
}
