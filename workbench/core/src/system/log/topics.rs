//! One value a line, behind the name of its signal: `time, topic, value`, as recorders of several topics and databases of time
//! series export it.

use super::stream::Text;
use super::text::{is_value, split};

/// How the column is called that names the signals. Nothing else tells it from a column of states.
const SIGNALS: [&str; 10] =
    ["topic", "signal", "name", "channel", "field", "_field", "key", "variable", "entry", "series"];
/// How the column of the values is called; else it is the last one.
const VALUES: [&str; 4] = ["value", "_value", "data", "val"];
/// More signals than this are none.
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

impl Topics {
    /// The signals below a header, and how they stand in its first rows; `None`: the table is an ordinary one.
    pub fn of<'a>(
        header: &[String],
        rows: impl Iterator<Item = &'a [String]> + Clone,
        text: &Text,
        (separator, first): (char, u64),
    ) -> Option<Self> {
        let called = |names: &[&str]| {
            header.iter().position(|name| names.iter().any(|known| name.eq_ignore_ascii_case(known)))
        };
        let signal = called(&SIGNALS)?;
        let value = called(&VALUES).unwrap_or(header.len() - 1);
        let is_time = |k: &usize| {
            let cell = |row: &[String]| row.get(*k).is_some_and(|cell| is_value(cell));
            *k != signal && *k != value && rows.clone().all(cell)
        };
        let timed = |k: &usize| header[*k].to_lowercase().trim_start_matches('_').starts_with("time");
        let times: Vec<usize> = (0..header.len()).filter(is_time).collect();
        let time = *times.iter().find(|k| timed(k)).or(times.first())?;
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
            Some(at) => format!(
                "{}{}{}{}",
                cell(self.time),
                "\t".repeat(at + 1),
                cell(self.value),
                "\t".repeat(self.names.len() - 1 - at)
            ),
            None => String::new(),
        }
    }
}
