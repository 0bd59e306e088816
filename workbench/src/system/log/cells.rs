//! The numbers of a file, column by column.

use super::dialect::{Dialect, Head};
use super::layout::Layout;
use super::records::{Record, Records};
use super::stream::Text;
use super::text::missing;
use crate::console::input_error::InputError;

/// The cells of a file with their line numbers.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Names of the columns.
    pub header: Vec<String>,
    /// Units below the names, where the file has such a row.
    pub units: Vec<Option<String>>,
    /// Line of the header.
    pub header_line: u64,
    /// Number of rows.
    pub rows: usize,
    /// Rows before which the header is repeated: the logger was started anew.
    pub restarts: Vec<usize>,
    /// How the file is written.
    pub dialect: Dialect,
    /// The columns.
    pub columns: Vec<Column>,
    /// Row and its line, where the rows after it follow line by line.
    lines: Vec<(usize, u64)>,
}

/// One column: a number a row, and what else was in it.
#[derive(Clone, Debug, Default)]
pub struct Column {
    /// NaN where there is no number.
    pub values: Vec<f64>,
    /// Cells that hold nothing.
    pub empty: usize,
    /// The first cell that is not a number or nothing: its row and what it holds.
    pub hole: Option<(usize, String)>,
    /// The first cell that holds a word or an infinite number.
    pub refused: Option<(usize, String)>,
}

impl Column {
    fn push(&mut self, cell: &str, dialect: &Dialect) {
        let row = self.values.len();
        let value = dialect.number(cell);
        self.values.push(value.unwrap_or(f64::NAN));
        match value {
            Some(value) if value.is_finite() => {}
            Some(value) if value.is_infinite() => self.refuse(row, cell),
            value => {
                let nothing = missing(cell);
                self.empty += usize::from(nothing);
                match nothing || value.is_some() {
                    true => self.hole = self.hole.take().or_else(|| Some((row, cell.to_owned()))),
                    false => self.refuse(row, cell),
                }
            }
        }
    }

    fn refuse(&mut self, row: usize, cell: &str) {
        if self.refused.is_none() {
            self.refused = Some((row, cell.to_owned()));
        }
    }
}

impl Cells {
    /// Reads a text in whatever dialect.
    pub fn read(source: &str, text: &Text, encoding: &'static str) -> Result<Self, InputError> {
        let layout = Layout::of(text).map_err(|error| InputError::file(source, error))?;
        let Some(layout) = layout else {
            let what = "is empty; expected a header line such as t_s,u_v,theta_rad";
            return Err(InputError::file(source, what));
        };
        let mut records = Records::of(source, text, &layout)?;
        let mut first = Record::default();
        let (head, found) = Head::read(source, &mut records, &mut first, &layout, encoding)?;
        if !found {
            return Err(InputError::file(
                source,
                "has a header but no rows of numbers; the log was not written",
            ));
        }
        let columns = head.names.iter().map(|_| Column::default()).collect();
        let cells = Self {
            header: head.names,
            units: head.units,
            header_line: head.line,
            rows: 0,
            restarts: Vec::new(),
            dialect: head.dialect,
            columns,
            lines: Vec::new(),
        };
        Rows { source, cells, ended: layout.ended, last: Last::default(), damage: Damage::default() }
            .read(&mut records, first)
    }

    /// The line of a row.
    pub fn line(&self, row: usize) -> u64 {
        let at = self.lines.partition_point(|known| known.0 <= row).saturating_sub(1);
        self.lines.get(at).map_or(1, |(from, line)| line + (row - from) as u64)
    }

    /// The numbers of a column, NaN where there is none.
    pub fn values(&self, index: usize) -> &[f64] {
        &self.columns[index].values
    }

    fn push(&mut self, row: &Record) {
        for (index, column) in self.columns.iter_mut().enumerate() {
            column.push(row.cell(index), &self.dialect);
        }
        let follows = |known: &(usize, u64)| known.1 + (self.rows - known.0) as u64 == row.line;
        if !self.lines.last().is_some_and(follows) {
            self.lines.push((self.rows, row.line));
        }
        self.rows += 1;
    }
}

/// Rows as they are taken.
struct Rows<'a> {
    source: &'a str,
    cells: Cells,
    /// The last line has its end.
    ended: bool,
    last: Last,
    damage: Damage,
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

/// Rows with too few or too many cells: how many, and line and cells of the first two.
#[derive(Default)]
struct Damage {
    count: usize,
    first: Option<(u64, usize)>,
    second: Option<u64>,
}

impl Rows<'_> {
    /// Takes the rows; a last one that was cut is left out, any other damage is an error.
    fn read(mut self, records: &mut Records, mut row: Record) -> Result<Cells, InputError> {
        let (mut next, mut begun) = (Record::default(), false);
        loop {
            let last = !records.read(&mut next)?;
            self.take(&row, begun && last);
            if last {
                break;
            }
            begun = true;
            std::mem::swap(&mut row, &mut next);
        }
        match self.damage.first {
            None => Ok(self.cells),
            Some((line, cells)) => Err(self.broken_rows(line, cells)),
        }
    }

    fn take(&mut self, row: &Record, last: bool) {
        let width = self.cells.header.len();
        if row.cells().eq(self.cells.header.iter().map(String::as_str)) {
            self.cells.restarts.push(self.cells.rows);
        } else if last && (row.len() < width || !self.ended && self.is_cut(row)) {
            self.cells.dialect.cut = Some(row.line);
        } else if row.len() == width || row.len() == width + 1 && row.cell(width).is_empty() {
            self.last.see(self.cells.dialect.decimals(row.cell(width - 1)), self.cells.rows == 0);
            self.cells.push(row);
        } else {
            self.damage.add(row);
        }
    }

    /// A last line without an end: its last cell is no number, or lacks decimals that every other number of the column has.
    fn is_cut(&self, row: &Record) -> bool {
        match self.cells.dialect.decimals(row.cell(self.cells.header.len() - 1)) {
            None => self.last.latest.is_some(),
            Some(own) => !self.last.differ && self.last.first.is_some_and(|first| first > own),
        }
    }

    fn broken_rows(&self, line: u64, cells: usize) -> InputError {
        let width = self.cells.header.len();
        let others = self.damage.count - 1;
        if self.cells.dialect.separator == ',' && others >= self.cells.rows && cells > width {
            let what = format!(
                "has {cells} cells where the header has {width}; if commas are decimal signs here, export the table with \
                 semicolons or tabs between the cells"
            );
            return InputError::line(self.source, line, what);
        }
        let more = match (others, self.damage.second) {
            (1, Some(other)) => format!(" (line {other} too)"),
            (_, Some(next)) => format!(" ({others} further rows too, the next is line {next})"),
            _ => String::new(),
        };
        let what = format!(
            "has {cells} cells where the header has {width}{more}; the file is truncated or damaged, remove the row"
        );
        InputError::line(self.source, line, what)
    }
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

impl Damage {
    fn add(&mut self, row: &Record) {
        self.count += 1;
        if self.first.is_none() {
            self.first = Some((row.line, row.len()));
        } else if self.second.is_none() {
            self.second = Some(row.line);
        }
    }
}
