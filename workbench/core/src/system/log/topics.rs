//! One value a line, behind the name of its signal: `time, topic, value`, as recorders of several topics and databases of time
//! series export it.

use super::stream::Text;
use super::text::{is_value, split};

/// How the column is called that names the signals. Nothing else tells it from a column of states.
const SIGNALS: [&str; 10] =
    ["topic", "signal", "name", "channel", "field", "_field", "key", "variable", "entry", "series"];
/// How the column of the values is called; else it is the last one.
const VALUES: [&str; 4] = ["value", "_value", "data", "val"];
/// More signals than this are none. Chosen by judgement; not studied.
const MOST: usize = 64;

/// Where time, signal and value stand in a line.
pub struct Topics {
    separator: char,
    time: usize,
    signal: usize,
    value: usize,
    /// The signals, in the order in which they come.
    names: Vec<String>,
}

/// The column that is called so.
fn called(header: &[String], names: &[&str]) -> Option<usize> {
    header.iter().position(|name| names.iter().any(|known| name.eq_ignore_ascii_case(known)))
}

/// These are the names of such a table: words may stand among its values.
pub fn is_head(cells: &[String]) -> bool {
    called(cells, &SIGNALS).is_some() && called(cells, &VALUES).is_some()
}

impl Topics {
    /// The signals below a header, and how they stand in its first rows; `None`: the table is an ordinary one.
    pub fn of<'a>(
        header: &[String],
        rows: impl Iterator<Item = &'a [String]> + Clone,
        text: &Text,
        (separator, first): (char, u64),
    ) -> Option<Self> {
        let signal = called(header, &SIGNALS)?;
        let value = called(header, &VALUES).unwrap_or(header.len() - 1);
        let is_time = |k: &usize| {
            let cell = |row: &[String]| row.get(*k).is_some_and(|cell| is_value(cell));
            *k != signal && *k != value && rows.clone().all(cell)
        };
        let timed = |k: &usize| header[*k].to_lowercase().trim_start_matches('_').starts_with("time");
        let time = (0..header.len()).rev().filter(is_time).max_by_key(timed)?;
        let (mut names, mut lines) = (Vec::<String>::new(), text.lines().ok()?);
        let mut number = 0;
        while let Ok(Some((line, _))) = lines.read()
            && names.len() <= MOST
        {
            number += 1;
            let cells = split(line, separator);
            let behind = number >= first && cells.len() >= header.len();
            let name = cells.get(signal).filter(|name| behind && !name.is_empty());
            let new = name.filter(|name| !names.iter().any(|known| known == *name));
            names.extend(new.map(|name| name.to_string()));
        }
        (2..=MOST).contains(&names.len()).then_some(Self { separator, time, signal, value, names })
    }

    /// The names of the columns of the table that it becomes.
    pub fn columns(&self, header: &[String]) -> Vec<String> {
        std::iter::once(&header[self.time]).chain(&self.names).cloned().collect()
    }

    /// A line as a row of that table, with tabs; empty where it holds no such signal.
    pub fn row(&self, line: &str) -> String {
        let cells = split(line, self.separator);
        let cell = |k: usize| cells.get(k).copied().unwrap_or_default();
        match self.names.iter().position(|name| name == cell(self.signal)) {
            Some(at) => {
                let (before, behind) = ("\t".repeat(at + 1), "\t".repeat(self.names.len() - 1 - at));
                format!("{}{before}{}{behind}", cell(self.time), cell(self.value))
            }
            None => String::new(),
        }
    }
}
