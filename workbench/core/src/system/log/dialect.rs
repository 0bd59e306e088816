//! How a table is written down, in words, and the numbers in its cells.

use super::text::{SEPARATORS, number, ungrouped};
use encoding_rs::UTF_8;

/// How a file is written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
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
    /// There is no header: the columns are called `c1`, `c2`, …
    pub headless: bool,
    /// Each value stands behind its name.
    pub labelled: bool,
    /// Each line holds one value of one signal.
    pub topics: bool,
    /// Cells hold several numbers.
    pub lists: bool,
    /// Lines before the header that are neither it nor a comment.
    pub preamble: usize,
    /// Lines between the rows that hold no number.
    pub words: usize,
    /// Rows whose thousands were parted by the sign that parts the cells.
    pub thousands: usize,
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
        if self.separator != ',' && !self.labelled {
            parts.push(format!("separated by {}", self.separated_by()));
        }
        let told = [
            (self.labelled, "whose values stand behind their names".to_owned()),
            (self.topics, "with one value a line, behind the name of its signal".into()),
            (self.lists, "with several numbers in a cell, which become columns of their own".into()),
            (self.decimal_comma, "with decimal commas".to_owned()),
            (self.units, "with a row of units".into()),
            (self.header_in_comment, "with the header in a comment".into()),
            (self.headless, "without a header line".into()),
            (self.preamble == 1, "after a line that is no table".into()),
            (self.preamble > 1, format!("after {} lines that are no table", self.preamble)),
            (self.words > 0, format!("without the lines that hold no number ({})", self.words)),
            (self.thousands > 0, format!("with commas between thousands (in {} rows)", self.thousands)),
        ];
        parts.extend(told.into_iter().filter(|told| told.0).map(|told| told.1));
        if let Some(line) = self.cut {
            parts.push(format!("without its last row (line {line}), which is cut"));
        }
        (!parts.is_empty()).then(|| format!("The log is read as a table {}.", parts.join(", ")))
    }

    /// Separator, decimal sign and encoding in words.
    pub fn written(&self) -> String {
        let decimals = if self.decimal_comma { " with decimal commas" } else { "" };
        format!("separated by {}{decimals}, {}", self.separated_by(), self.encoding)
    }

    /// The separator in words.
    pub fn separated_by(&self) -> &'static str {
        SEPARATORS.iter().find(|known| known.0 == self.separator).map_or("", |known| known.1)
    }

    /// The number in a cell. `None`: there is none.
    pub fn number(&self, cell: &str) -> Option<f64> {
        match self.decimal_comma {
            false => number(cell).or_else(|| number(&ungrouped(cell, '.')?)),
            // Beside decimal commas a point is one of thousands.
            true if cell.contains('.') => number(&ungrouped(cell, ',')?),
            true => number(&cell.replacen(',', ".", 1)),
        }
    }

    /// How many decimals a number has. `None`: the cell holds none.
    pub fn decimals(&self, cell: &str) -> Option<usize> {
        self.number(cell).map(|_| cell.split_once(['.', ',']).map_or(0, |parted| parted.1.len()))
    }
}
