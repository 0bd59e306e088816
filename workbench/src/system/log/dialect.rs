//! How a table is written down: encoding, separator, decimal sign, comments, header, row of units. All of it is recognised.

use super::layout::Layout;
use super::records::{Record, Records};
use super::text::{COMMENTS, SEPARATORS, number, split};
use super::words::unit;
use crate::console::input_error::InputError;
use encoding_rs::UTF_8;
use std::collections::VecDeque;

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
            true => with_point(cell),
            false => number(cell),
        }
    }

    /// How many decimals a number has. `None`: the cell holds none.
    pub fn decimals(&self, cell: &str) -> Option<usize> {
        self.number(cell).map(|_| cell.split_once(['.', ',']).map_or(0, |parted| parted.1.len()))
    }
}

/// Letters of the longest number that is read without an allocation.
const USUAL: usize = 40;

/// The number in a cell with a decimal comma.
fn with_point(cell: &str) -> Option<f64> {
    let Some(comma) = cell.find(',').filter(|_| cell.len() <= USUAL) else {
        return number(&cell.replacen(',', ".", 1));
    };
    let mut letters = [0; USUAL];
    letters[..cell.len()].copy_from_slice(cell.as_bytes());
    letters[comma] = b'.';
    std::str::from_utf8(&letters[..cell.len()]).ok().and_then(number)
}

/// What stands above the numbers of a file.
pub struct Head {
    /// Names of the columns.
    pub names: Vec<String>,
    /// Units below the names, where the file has such a row.
    pub units: Vec<Option<String>>,
    /// Line of the names.
    pub line: u64,
    /// How the file is written.
    pub dialect: Dialect,
}

impl Head {
    /// Reads the rows up to the first one of numbers, which is then in `first`. The second: there is such a row.
    pub fn read(
        source: &str,
        rows: &mut Records,
        first: &mut Record,
        layout: &Layout,
        encoding: &'static str,
    ) -> Result<(Self, bool), InputError> {
        let mut dialect = Dialect {
            encoding,
            separator: layout.separator,
            decimal_comma: layout.decimal_comma,
            units: false,
            header_in_comment: false,
            comments: layout.comments,
            preamble: 0,
            cut: None,
        };
        let (mut before, mut last_two) = (0, VecDeque::new());
        let mut found = false;
        while !found && rows.read(first)? {
            found = is_numeric(first, &dialect);
            if !found {
                before += 1;
                last_two.push_back((first.line, first.cells().map(str::to_owned).collect()));
                while last_two.len() > 2 {
                    last_two.pop_front();
                }
            }
        }
        let first = found.then_some(&*first);
        let last = (before, Vec::from(last_two));
        header(source, last, first, layout, &mut dialect).map(|head| (head, found))
    }
}

fn is_numeric(row: &Record, dialect: &Dialect) -> bool {
    let filled = row.cells().filter(|cell| !cell.is_empty()).count();
    let numbers = row.cells().filter(|cell| dialect.number(cell).is_some()).count();
    numbers > 0 && 2 * numbers >= filled
}

/// Line number and cells of a row.
type Line = (u64, Vec<String>);

/// Header and units out of the lines before the numbers: their number, and the last two.
fn header(
    source: &str,
    (mut count, mut before): (usize, Vec<Line>),
    first: Option<&Record>,
    layout: &Layout,
    dialect: &mut Dialect,
) -> Result<Head, InputError> {
    let width = first.map_or(0, |row| row.cells().rev().skip_while(|cell| cell.is_empty()).count());
    let mut units = Vec::new();
    if let [(_, names), (_, last)] = &before[..]
        && names.len() >= 2
        && are_units(last)
    {
        units.clone_from(last);
        dialect.units = true;
        before.pop();
        count -= 1;
    }
    let (line, mut names) = match before.pop() {
        Some(names) => {
            count -= 1;
            names
        }
        None => {
            let names = layout.last_comment.as_ref().and_then(|comment| in_comment(comment, dialect, width));
            let Some(names) = names else {
                let line = first.map_or(1, |row| row.line);
                let what = "starts with numbers; add a header line such as t_s,u_v,theta_rad";
                return Err(InputError::line(source, line, what));
            };
            dialect.header_in_comment = true;
            (1, names)
        }
    };
    dialect.preamble = count;
    if names.len() > 1 && names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    check_names(source, line, &names)?;
    let unit = |k: usize| units.get(k).cloned().filter(|unit: &String| !unit.is_empty());
    let units = (0..names.len()).map(unit).collect();
    Ok(Head { names, units, line, dialect: dialect.clone() })
}

/// A row below the names whose cells are units, at least half of them known.
fn are_units(row: &[String]) -> bool {
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
