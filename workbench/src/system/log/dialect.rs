//! How a table is written down: encoding, separator, decimal sign, comments, header, row of units. All of it is recognised.

use super::text::{COMMENTS, Row, SEPARATORS, number, records, separator, split, without_comments};
use super::words::unit;
use crate::console::input_error::InputError;
use encoding_rs::UTF_8;
use std::borrow::Cow;

/// How a file is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// Name of the encoding.
    pub encoding: &'static str,
    /// What parts the cells.
    pub separator: char,
    /// True: `0,5` is a half.
    pub decimal_comma: bool,
    /// A row of units follows the header.
    pub units: bool,
    /// The header stands in a comment.
    pub header_in_comment: bool,
    /// Lines of comment.
    pub comments: usize,
    /// Lines before the header that are neither.
    pub preamble: usize,
    /// Line of a last row that was cut and is left out.
    pub cut: Option<u64>,
}

impl Dialect {
    /// What is unusual about it, in one sentence; none for a plain CSV.
    pub fn sentence(&self) -> Option<String> {
        let mut parts = Vec::new();
        if self.encoding != UTF_8.name() {
            parts.push(format!("in {}", self.encoding));
        }
        if self.separator != ',' {
            parts.push(format!("separated by {}", self.separated_by()));
        }
        let told = [
            (self.decimal_comma, "with decimal commas".to_owned()),
            (self.units, "with a row of units".into()),
            (self.header_in_comment, "with the header in a comment".into()),
            (self.preamble == 1, "after a line that is no table".into()),
            (self.preamble > 1, format!("after {} lines that are no table", self.preamble)),
        ];
        parts.extend(told.into_iter().filter(|told| told.0).map(|told| told.1));
        if let Some(line) = self.cut {
            parts.push(format!("without its last row (line {line}), which is cut"));
        }
        (!parts.is_empty()).then(|| format!("The log is read as a table {}.", parts.join(", ")))
    }

    /// The separator in words.
    pub fn separated_by(&self) -> &'static str {
        SEPARATORS.iter().find(|known| known.0 == self.separator).map_or("", |known| known.1)
    }

    /// The number in a cell. `None`: there is none.
    pub fn number(&self, cell: &str) -> Option<f64> {
        match self.decimal_comma {
            // Beside decimal commas a point would be one of thousands.
            true if cell.contains('.') => None,
            true => number(&cell.replacen(',', ".", 1)),
            false => number(cell),
        }
    }
}

/// The cells of a file with their line numbers.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Names of the columns.
    pub header: Vec<String>,
    /// Units below the names, where the file has such a row.
    pub units: Vec<Option<String>>,
    /// Line numbers and cells.
    pub rows: Vec<Row>,
    /// Line of the header.
    pub header_line: u64,
    /// Rows before which the header is repeated: the logger was started anew.
    pub restarts: Vec<usize>,
    /// How the file is written.
    pub dialect: Dialect,
}

impl Cells {
    /// Reads a text in whatever dialect.
    pub fn read(source: &str, text: &str, encoding: &'static str) -> Result<Self, InputError> {
        let text = text.trim_start_matches('\u{feff}');
        let text = match text.contains('\n') {
            true => Cow::Borrowed(text),
            false => Cow::Owned(text.replace('\r', "\n")),
        };
        let empty = || InputError::file(source, "is empty; expected a header line such as t_s,u_v,theta_rad");
        let (separator, decimal_comma) = separator(&text).ok_or_else(empty)?;
        let (plain, comments) = without_comments(&text, separator);
        let rows = records(source, &plain, separator)?;
        let mut dialect = Dialect {
            encoding,
            separator,
            decimal_comma,
            units: false,
            header_in_comment: false,
            comments: comments.len(),
            preamble: 0,
            cut: None,
        };
        let begin = rows.iter().position(|row| is_numeric(&row.1, &dialect)).unwrap_or(rows.len());
        let (mut before, mut rows) = (rows, Vec::new());
        rows.append(&mut before.split_off(begin));
        let mut cells = header(source, before, rows.first(), &comments, &mut dialect)?;
        if rows.is_empty() {
            return Err(InputError::file(
                source,
                "has a header but no rows of numbers; the log was not written",
            ));
        }
        cells.dialect = dialect;
        cells.take(source, rows, text.ends_with(['\n', '\r']))?;
        Ok(cells)
    }

    /// Takes the rows; a last one that was cut is left out, any other damage is an error.
    fn take(&mut self, source: &str, rows: Vec<Row>, ended: bool) -> Result<(), InputError> {
        let width = self.header.len();
        let whole = |row: &csv::StringRecord| {
            row.len() == width || row.len() == width + 1 && row.get(width) == Some("")
        };
        let last = rows.len() - 1;
        let mut damaged: Vec<(u64, usize)> = Vec::new();
        for (k, (line, row)) in rows.into_iter().enumerate() {
            let cut = || k == last && k > 0 && (row.len() < width || !ended && self.is_cut(&row));
            if row.iter().eq(self.header.iter().map(String::as_str)) {
                self.restarts.push(self.rows.len());
            } else if cut() {
                self.dialect.cut = Some(line);
            } else if whole(&row) {
                self.rows.push((line, row));
            } else {
                damaged.push((line, row.len()));
            }
        }
        match damaged.first() {
            None => Ok(()),
            Some((line, cells)) => Err(self.broken_rows(source, *line, *cells, &damaged[1..])),
        }
    }

    /// A last line without an end: its last cell is no number, or lacks decimals that every other number of the column has.
    fn is_cut(&self, row: &csv::StringRecord) -> bool {
        let decimals = |row: &csv::StringRecord| {
            let cell = row.get(self.header.len() - 1).unwrap_or("");
            let digits = |parted: (&str, &str)| parted.1.len();
            self.dialect.number(cell).map(|_| cell.split_once(['.', ',']).map_or(0, digits))
        };
        let Some(own) = decimals(row) else {
            return self.rows.last().is_some_and(|before| decimals(&before.1).is_some());
        };
        let others: Vec<_> = self.rows.iter().map(|before| decimals(&before.1)).collect();
        others.first().is_some_and(|first| *first > Some(own) && others.iter().all(|other| other == first))
    }

    /// Rows with too few or too many cells.
    fn broken_rows(&self, source: &str, line: u64, cells: usize, others: &[(u64, usize)]) -> InputError {
        let width = self.header.len();
        if self.dialect.separator == ',' && others.len() >= self.rows.len() && cells > width {
            let what = format!(
                "has {cells} cells where the header has {width}; if commas are decimal signs here, export the table with \
                 semicolons or tabs between the cells"
            );
            return InputError::line(source, line, what);
        }
        let more = match others {
            [] => String::new(),
            [other] => format!(" (line {} too)", other.0),
            [first, ..] => format!(" ({} further rows too, the next is line {})", others.len(), first.0),
        };
        let what = format!(
            "has {cells} cells where the header has {width}{more}; the file is truncated or damaged, remove the row"
        );
        InputError::line(source, line, what)
    }
}

fn is_numeric(row: &csv::StringRecord, dialect: &Dialect) -> bool {
    let filled = row.iter().filter(|cell| !cell.is_empty()).count();
    let numbers = row.iter().filter(|cell| dialect.number(cell).is_some()).count();
    numbers > 0 && 2 * numbers >= filled
}

/// Header and units out of the lines before the numbers.
fn header(
    source: &str,
    mut before: Vec<Row>,
    first: Option<&Row>,
    comments: &[String],
    dialect: &mut Dialect,
) -> Result<Cells, InputError> {
    let width = first.map_or(0, |row| row.1.iter().rev().skip_while(|cell| cell.is_empty()).count());
    let cells = |row: &csv::StringRecord| -> Vec<String> { row.iter().map(str::to_owned).collect() };
    let mut units = Vec::new();
    if let [.., (_, names), (_, last)] = &before[..]
        && names.len() >= 2
        && are_units(last)
    {
        units = cells(last);
        dialect.units = true;
        before.pop();
    }
    let (line, mut names) = match before.pop() {
        Some((line, row)) => (line, cells(&row)),
        None => {
            let Some(names) = comments.last().and_then(|comment| in_comment(comment, dialect, width)) else {
                let line = first.map_or(1, |row| row.0);
                let what = "starts with numbers; add a header line such as t_s,u_v,theta_rad";
                return Err(InputError::line(source, line, what));
            };
            dialect.header_in_comment = true;
            (1, names)
        }
    };
    dialect.preamble = before.len();
    if names.len() > 1 && names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    check_names(source, line, &names)?;
    let unit = |k: usize| units.get(k).cloned().filter(|unit: &String| !unit.is_empty());
    let units = (0..names.len()).map(unit).collect();
    Ok(Cells {
        header: names,
        units,
        rows: Vec::new(),
        header_line: line,
        restarts: Vec::new(),
        dialect: dialect.clone(),
    })
}

/// A row below the names whose cells are units, at least half of them known.
fn are_units(row: &csv::StringRecord) -> bool {
    let filled = row.iter().filter(|cell| !cell.is_empty()).count();
    let known = row.iter().filter(|cell| unit(cell).is_some()).count();
    known > 0 && 2 * known >= filled
}

/// The names in a comment line, as `numpy.savetxt` writes them.
fn in_comment(comment: &str, dialect: &Dialect, width: usize) -> Option<Vec<String>> {
    let text = COMMENTS.iter().find_map(|mark| comment.trim_start().strip_prefix(mark))?.trim();
    let names = split(text, dialect.separator);
    let names: Vec<String> = names.into_iter().map(|name| name.trim_matches('"').to_owned()).collect();
    (names.len() == width && width > 1).then_some(names)
}

fn check_names(source: &str, line: u64, names: &[String]) -> Result<(), InputError> {
    if names.iter().all(String::is_empty) {
        return Err(InputError::line(
            source,
            line,
            "the header has no names; expected a header line such as t_s,u_v,theta_rad",
        ));
    }
    let twice = |k: &usize| !names[*k].is_empty() && names[..*k].contains(&names[*k]);
    match (0..names.len()).find(twice) {
        None => Ok(()),
        Some(k) => {
            let what = format!("two columns are named `{}`; rename one", names[k]);
            Err(InputError::line(source, line, what))
        }
    }
}
