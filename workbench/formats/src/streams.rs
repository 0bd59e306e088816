//! Signals at their own rates, as recorders write them, and the table of all their stamps.

use crate::naming::{self, MOST_COLUMNS, MOST_MEMBERS};
use std::collections::HashMap;
use truing_core::system::log::cells::{Cells, Column};

/// Cells of a table that is held in memory: 1 GiB.
const MOST_CELLS: usize = 1 << 27;
/// The name of the time.
const TIME: &str = "t_s";

/// The messages of one topic: their stamps, and a column for each number in them.
#[derive(Default)]
pub struct Stream {
    /// How the topic is called.
    pub name: String,
    /// When each message was, in ticks of the file.
    pub stamps: Vec<u64>,
    fields: Vec<Field>,
    known: HashMap<String, usize>,
    path: String,
    next: usize,
    /// Numbers that found no column, because there are too many.
    crowded: bool,
}

#[derive(Default)]
struct Field {
    name: String,
    values: Vec<f64>,
    /// A list that is too long to be a log.
    left_out: bool,
}

impl Stream {
    /// A topic without messages.
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    /// A message begins.
    pub fn begin(&mut self, stamp: u64) {
        self.stamps.push(stamp);
        self.path.clear();
        self.next = 0;
    }

    /// The last message is not taken.
    pub fn undo(&mut self) {
        self.truncate(self.stamps.len().saturating_sub(1));
    }

    fn truncate(&mut self, rows: usize) {
        self.stamps.truncate(rows);
        self.fields.iter_mut().for_each(|field| field.values.truncate(rows));
    }

    /// Goes into a field, and says how to leave it.
    pub fn enter(&mut self, name: &str) -> usize {
        let before = self.path.len();
        if before > 0 {
            self.path.push('.');
        }
        self.path.push_str(name);
        before
    }

    /// Goes into a member of a list, and says how to leave it.
    pub fn member(&mut self, index: usize) -> usize {
        use std::fmt::Write;
        let before = self.path.len();
        // Writing into a string cannot fail.
        let _ = write!(self.path, "{}{index}", if before > 0 { "_" } else { "" });
        before
    }

    /// Back to where it was.
    pub fn leave(&mut self, before: usize) {
        self.path.truncate(before);
    }

    /// A list of so many members is over. One that is too long becomes no columns.
    pub fn close_list(&mut self, members: usize) {
        if members <= MOST_MEMBERS {
            return;
        }
        let path = &self.path;
        let inside = |name: &str| {
            let rest = name.strip_prefix(path.as_str()).map(|rest| rest.trim_start_matches('_'));
            rest.is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
        };
        self.fields.iter_mut().filter(|field| inside(&field.name)).for_each(|field| field.left_out = true);
    }

    /// The field holds this number in this message.
    pub fn number(&mut self, value: f64) {
        let Some(index) = self.index() else {
            self.crowded = true;
            return;
        };
        self.next = index + 1;
        self.put(index, value);
    }

    /// The field of this number of the format holds this number.
    pub fn put(&mut self, index: usize, value: f64) {
        let row = self.stamps.len().saturating_sub(1);
        let field = &mut self.fields[index];
        if !field.left_out {
            field.values.resize(row.max(field.values.len()), f64::NAN);
            field.values.truncate(row);
            field.values.push(value);
        }
    }

    fn index(&mut self) -> Option<usize> {
        let is_next = self.fields.get(self.next).is_some_and(|field| field.name == self.path);
        if is_next {
            return Some(self.next);
        }
        self.known.get(&self.path).copied().or_else(|| self.add(&self.path.clone()))
    }

    /// A new column.
    pub fn add(&mut self, name: &str) -> Option<usize> {
        let index = self.fields.len();
        (index < MOST_COLUMNS).then(|| {
            self.known.insert(name.to_owned(), index);
            self.fields.push(Field { name: name.to_owned(), ..Field::default() });
            index
        })
    }

    /// The numbers of a field, if every message has one.
    pub fn complete_field(&self, name: &str) -> Option<&[f64]> {
        let field = &self.fields[*self.known.get(name)?];
        let all = field.values.len() == self.stamps.len() && field.values.iter().all(|it| it.is_finite());
        all.then_some(&field.values)
    }

    /// It has a number.
    pub fn holds_numbers(&self) -> bool {
        self.fields.iter().any(|field| !field.left_out && !field.values.is_empty())
    }
}

/// The topics of a file.
#[derive(Default)]
pub struct Streams {
    /// In the order in which they come.
    pub list: Vec<Stream>,
    /// How the file was read, in sentences.
    pub told: Vec<String>,
}

impl Streams {
    /// How much there is.
    pub fn mark(&self) -> Vec<usize> {
        self.list.iter().map(|stream| stream.stamps.len()).collect()
    }

    /// Leaves out what came after a mark.
    pub fn back_to(&mut self, mark: &[usize]) {
        let rows = mark.iter().copied().chain(std::iter::repeat(0));
        self.list.iter_mut().zip(rows).for_each(|(stream, rows)| stream.truncate(rows));
    }

    /// Messages of all topics.
    pub fn messages(&self) -> usize {
        self.list.iter().map(|stream| stream.stamps.len()).sum()
    }

    /// One table: a row for each stamp, and nothing where a topic has none. `ticks`: of the stamps a second.
    pub fn cells(mut self, written: &str, ticks: f64) -> Result<Cells, String> {
        self.list.retain(Stream::holds_numbers);
        if self.list.iter().any(|stream| stream.crowded) {
            self.told.push(format!("Only the first {MOST_COLUMNS} numbers of a topic are read."));
        }
        let places: Vec<Places> = self.list.iter().map(|stream| Places::of(&stream.stamps)).collect();
        let stamps = together(&places);
        self.shrink(stamps.len())?;
        let first = stamps.first().map_or(0, |key| key.0);
        let since = |key: &Key| (key.0 - first) as f64 / ticks;
        let mut columns: Vec<(String, Column)> =
            vec![(TIME.into(), naming::column(stamps.iter().map(since).collect()))];
        for (stream, places) in self.list.into_iter().zip(places) {
            let rows = places.rows(&stamps);
            for mut field in stream.fields.into_iter().filter(|field| !field.left_out) {
                field.values.resize(stream.stamps.len(), f64::NAN);
                let name = joined(&stream.name, &field.name);
                columns.push((name, naming::column(spread(field.values, &rows, stamps.len()))));
            }
        }
        naming::table(columns, written, &self.told)
    }

    /// A table that is too large goes without columns that never change.
    fn shrink(&mut self, rows: usize) -> Result<(), String> {
        let count = |list: &[Stream]| -> usize {
            list.iter().flat_map(|stream| &stream.fields).filter(|field| !field.left_out).count()
        };
        if rows.saturating_mul(count(&self.list)) <= MOST_CELLS {
            return Ok(());
        }
        let before = count(&self.list);
        for field in self.list.iter_mut().flat_map(|stream| &mut stream.fields) {
            let first = field.values.iter().find(|value| value.is_finite());
            field.left_out |= field.values.iter().all(|value| value.is_nan() || Some(value) == first);
        }
        let left = count(&self.list);
        self.told.push(format!("Of {before} columns those that never change are left out."));
        match rows.saturating_mul(left) <= MOST_CELLS {
            true => Ok(()),
            false => Err(format!(
                "holds {left} columns at {rows} stamps, too many for one table; keep the topics of the motor alone and write \
                 the file anew"
            )),
        }
    }
}

/// The name of a column: the topic, and the field in it.
fn joined(topic: &str, field: &str) -> String {
    let topic = topic.trim_start_matches('/');
    match (topic.is_empty(), field.is_empty()) {
        (_, true) => topic.to_owned(),
        (true, _) => field.to_owned(),
        // The whole message is a list.
        _ if field.starts_with(|c: char| c.is_ascii_digit()) => format!("{topic}_{field}"),
        _ => format!("{topic}.{field}"),
    }
}

/// A stamp, and how many of it the topic had before: messages of one time stay apart.
type Key = (u64, u32);

/// The stamps of a topic in the order of time.
struct Places {
    keys: Vec<Key>,
    /// Which message it is; `None`: they are in order.
    order: Option<Vec<usize>>,
}

impl Places {
    fn of(stamps: &[u64]) -> Self {
        let order = (!stamps.is_sorted()).then(|| {
            let mut order: Vec<usize> = (0..stamps.len()).collect();
            order.sort_by_key(|k| stamps[*k]);
            order
        });
        let mut keys: Vec<Key> = Vec::with_capacity(stamps.len());
        for k in 0..stamps.len() {
            let stamp = stamps[order.as_ref().map_or(k, |order| order[k])];
            let again = keys.last().filter(|last| last.0 == stamp).map_or(0, |last| last.1 + 1);
            keys.push((stamp, again));
        }
        Self { keys, order }
    }

    /// The row of each message; `None`: they are the same.
    fn rows(self, stamps: &[Key]) -> Option<Vec<usize>> {
        if self.order.is_none() && self.keys.len() == stamps.len() {
            return None;
        }
        let mut rows = vec![0; self.keys.len()];
        let mut at = 0;
        for (k, key) in self.keys.iter().enumerate() {
            at += stamps[at..].partition_point(|stamp| stamp < key).min(stamps.len() - 1 - at);
            rows[self.order.as_ref().map_or(k, |order| order[k])] = at;
        }
        Some(rows)
    }
}

fn together(places: &[Places]) -> Vec<Key> {
    let mut all: Vec<Key> = places.iter().flat_map(|places| places.keys.iter().copied()).collect();
    if !all.is_sorted() {
        all.sort_unstable();
    }
    all.dedup();
    all
}

fn spread(mut values: Vec<f64>, rows: &Option<Vec<usize>>, all: usize) -> Vec<f64> {
    let Some(rows) = rows else {
        values.shrink_to_fit();
        return values;
    };
    let mut spread = vec![f64::NAN; all];
    for (value, row) in values.into_iter().zip(rows) {
        spread[*row] = value;
    }
    spread
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(name: &str, rows: &[(u64, f64)]) -> Stream {
        let mut stream = Stream::new(name);
        for (stamp, value) in rows {
            stream.begin(*stamp);
            stream.number(*value);
        }
        stream
    }

    #[test]
    fn signals_at_their_own_rates_become_one_table_with_empty_cells() {
        let list =
            vec![stream("/a", &[(30, 3.0), (10, 1.0), (10, 1.5)]), stream("b", &[(10, 7.0), (20, 8.0)])];
        let cells = Streams { list, ..Streams::default() }.cells("test", 10.0).unwrap();
        assert_eq!(cells.header, ["t_s", "a", "b"]);
        assert_eq!(cells.values(0), [0.0, 0.0, 1.0, 2.0]);
        let shown = |k: usize| format!("{:?}", cells.values(k));
        assert_eq!(shown(1), "[1.0, 1.5, NaN, 3.0]");
        assert_eq!(shown(2), "[7.0, NaN, 8.0, NaN]");
    }

    #[test]
    fn a_list_that_is_too_long_becomes_no_columns() {
        let mut stream = Stream::new("image");
        for members in [3, 100] {
            stream.begin(0);
            let back = stream.enter("data");
            for k in 0..members {
                let inner = stream.member(k);
                stream.number(1.0);
                stream.leave(inner);
            }
            stream.close_list(members);
            stream.leave(back);
        }
        assert!(!stream.holds_numbers());
    }
}
