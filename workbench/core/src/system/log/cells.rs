//! The numbers of a file, column by column.

use super::clock::Form;
use super::dialect::Dialect;
use super::layout::Layout;
use super::records::{Record, Records};
use super::stream::Text;
use super::text::{is_value, missing};
use crate::text::input_error::InputError;

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
    /// Its cells are times of day or carry a unit: the first one that holds something tells.
    pub form: Option<Form>,
    begun: bool,
}

impl Column {
    fn push(&mut self, cell: &str, dialect: &Dialect) {
        let row = self.values.len();
        let mut value = match &self.form {
            None => dialect.number(cell),
            Some(form) => form.number(cell, |cell| dialect.number(cell)),
        };
        if value.is_none() && !self.begun && !missing(cell) {
            self.form = Form::of(cell);
            value = self.form.as_ref().and_then(|form| form.number(cell, |cell| dialect.number(cell)));
        }
        self.begun |= !missing(cell);
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
        let (layout, head, dialect) = Layout::of(source, text, encoding)?;
        let mut records = Records::of(source, text, &layout)?;
        let columns = head.names.iter().map(|_| Column::default()).collect();
        let cells = Self {
            header: head.names,
            units: head.units,
            header_line: head.line,
            rows: 0,
            restarts: Vec::new(),
            dialect,
            columns,
            lines: Vec::new(),
        };
        let mut cells =
            Rows { source, cells, last: Last::default(), damage: Vec::new() }.read(&mut records)?;
        if cells.dialect.topics {
            cells.sort_by_time();
        }
        for (unit, column) in cells.units.iter_mut().zip(&cells.columns) {
            if let Some(Form::Unit(written)) = &column.form {
                unit.get_or_insert_with(|| written.clone());
            }
        }
        Ok(cells)
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

    /// Signals may stand one behind the other, each from the first time to the last.
    fn sort_by_time(&mut self) {
        let time = &self.columns[0].values;
        let mut order: Vec<usize> = (0..self.rows).collect();
        order.sort_by(|a, b| time[*a].total_cmp(&time[*b]));
        self.lines = order.iter().map(|row| self.line(*row)).enumerate().collect();
        for column in &mut self.columns {
            column.values = order.iter().map(|row| column.values[*row]).collect();
            let found = column.hole.iter_mut().chain(&mut column.refused);
            found.for_each(|found| found.0 = order.iter().position(|row| *row == found.0).unwrap_or(0));
        }
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

/// A table has so many rows, or more of them than lines without a number.
const LEAST: usize = 3;

/// Rows as they are taken.
struct Rows<'a> {
    source: &'a str,
    cells: Cells,
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
    fn read(mut self, records: &mut Records) -> Result<Cells, InputError> {
        let (mut row, mut next, mut begun) = (Record::default(), Record::default(), false);
        let mut more = records.read(&mut row)?;
        while more {
            more = records.read(&mut next)?;
            self.take(&mut row, begun && !more);
            begun = true;
            std::mem::swap(&mut row, &mut next);
        }
        match self.damage.first() {
            None if self.cells.rows >= LEAST => Ok(self.cells),
            // Where no row fits the header, there is a table below a header that does not.
            _ if self.cells.rows > 0 && self.cells.dialect.words + self.damage.len() > self.cells.rows => {
                Err(self.no_table())
            }
            None => Ok(self.cells),
            Some(&(line, cells)) => Err(self.broken_rows(line, cells)),
        }
    }

    fn take(&mut self, row: &mut Record, last: bool) {
        let width = self.cells.header.len();
        let fits = |row: &Record| row.len() == width || row.len() == width + 1 && row.cell(width).is_empty();
        if row.len() > width
            && !fits(row)
            && self.cells.dialect.separator == ','
            && join_thousands(row, width)
        {
            self.cells.dialect.thousands += 1;
        }
        if row.cells().eq(self.cells.header.iter().map(String::as_str)) {
            self.cells.restarts.push(self.cells.rows);
        } else if !row.cells().any(is_value) && !row.cells().all(missing) {
            self.cells.dialect.words += 1;
        } else if last && (row.len() < width || !row.ended && self.is_cut(row)) {
            self.cells.dialect.cut = Some(row.line);
        } else if fits(row) {
            self.last.see(self.cells.dialect.decimals(row.cell(width - 1)), self.cells.rows == 0);
            self.cells.push(row);
        } else {
            self.damage.push((row.line, row.len()));
        }
    }

    /// A last line without an end: its last cell is no number, or lacks decimals that every other number of the column has.
    fn is_cut(&self, row: &Record) -> bool {
        match self.cells.dialect.decimals(row.cell(self.cells.header.len() - 1)) {
            None => self.last.latest.is_some(),
            Some(own) => !self.last.differ && self.last.first.is_some_and(|first| first > own),
        }
    }

    /// A text with a few rows of numbers somewhere in it.
    fn no_table(&self) -> InputError {
        let (rows, others) = (self.cells.rows, self.cells.dialect.words + self.damage.len());
        let what = format!(
            "is no table: {rows} of its lines hold as many numbers as the first one, {others} do not; export the log as CSV"
        );
        InputError::file(self.source, what)
    }

    fn broken_rows(&self, line: u64, cells: usize) -> InputError {
        let width = self.cells.header.len();
        let others = self.damage.len() - 1;
        if self.cells.dialect.separator == ',' && others >= self.cells.rows && cells > width {
            let what = format!(
                "has {cells} cells where the header has {width}; if commas are decimal signs here, export the table with \
                 semicolons or tabs between the cells"
            );
            return InputError::line(self.source, line, what);
        }
        if self.cells.dialect.separator == ',' && cells > width && self.cells.dialect.thousands > 0 {
            let what = format!(
                "has {cells} cells where the header has {width}: a comma between thousands is also what parts the cells, and this \
                 row can be read in several ways; export the table without signs between the thousands, or with semicolons"
            );
            return InputError::line(self.source, line, what);
        }
        let more = match (others, self.damage.get(1)) {
            (1, Some((other, _))) => format!(" (line {other} too)"),
            (_, Some((next, _))) => format!(" ({others} further rows too, the next is line {next})"),
            _ => String::new(),
        };
        let what = format!(
            "has {cells} cells where the header has {width}{more}; the file is truncated or damaged, remove the row"
        );
        InputError::line(self.source, line, what)
    }
}

/// Puts numbers together that were parted at their thousands, where that can be done in one way alone: `1,234.50`.
fn join_thousands(row: &mut Record, width: usize) -> bool {
    let cells: Vec<String> = row.cells().map(str::to_owned).collect();
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
    row.set(joined.iter().map(String::as_str));
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
