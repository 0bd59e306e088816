//! Cells that hold several numbers, as recorders of robots write the joints of one message: `"[0.1, 0.2]"`, `array('d', [0.1, 0.2])`.

use super::text::{is_value, split};

/// A list of more numbers is a picture or a map. Chosen by judgement; not studied.
const MOST: usize = 64;

/// How many numbers the cells of each column hold; 0: they hold no list.
pub struct Lists {
    separator: char,
    widths: Vec<usize>,
}

/// The numbers in the brackets of a cell; none where it holds no list.
fn members(cell: &str) -> Vec<&str> {
    let cell = cell.strip_prefix("array(").and_then(|cell| cell.strip_suffix(')')).unwrap_or(cell);
    let cell = cell.trim_start_matches(|c: char| c.is_ascii_alphabetic() || "'\", ".contains(c));
    let inside = [('[', ']'), ('(', ')'), ('{', '}')]
        .into_iter()
        .find_map(|(open, close)| cell.strip_prefix(open)?.strip_suffix(close));
    let parted = inside.unwrap_or_default().split([',', ';', ' ', '\t', '\n']);
    let members: Vec<&str> = parted.map(str::trim).filter(|member| !member.is_empty()).collect();
    let numbers = members.len() <= MOST && members.iter().all(|member| is_value(member));
    if numbers { members } else { Vec::new() }
}

impl Lists {
    /// The lists in the first rows of a text; `None`: most rows hold none. A unit may stand in brackets, too.
    pub fn of<'a>(rows: impl Iterator<Item = &'a [String]>, separator: char) -> Option<Self> {
        let (mut widths, mut all, mut some) = (Vec::new(), 0, 0);
        for cells in rows {
            all += 1;
            let own: Vec<usize> = cells.iter().map(|cell| members(cell).len()).collect();
            if own.iter().any(|width| *width > 0) {
                some += 1;
                widths.resize(own.len().max(widths.len()), 0);
                widths.iter_mut().zip(own).for_each(|(width, own)| *width = own.max(*width));
            }
        }
        (2 * some > all).then_some(Self { separator, widths })
    }

    /// A line as a row with one number a cell, with tabs.
    pub fn row(&self, line: &str) -> String {
        self.spread(split(line, self.separator).into_iter()).join("\t")
    }

    /// The names of the columns, or the cells of a row, of the table that it becomes: `position` of two becomes `position_0` and
    /// `position_1`.
    pub fn spread<'a>(&self, cells: impl Iterator<Item = &'a str>) -> Vec<String> {
        let spread = |(column, cell): (usize, &str)| -> Vec<String> {
            let (width, members) = (self.widths.get(column).copied().unwrap_or(0), members(cell));
            let at = |k: usize| match members.get(k) {
                Some(member) => (*member).to_owned(),
                None if members.is_empty() && width > 1 && !cell.is_empty() => format!("{cell}_{k}"),
                None if members.is_empty() => cell.to_owned(),
                None => String::new(),
            };
            (0..width.max(1)).map(at).collect()
        };
        cells.enumerate().flat_map(spread).collect()
    }
}
