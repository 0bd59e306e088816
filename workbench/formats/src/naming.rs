//! Names of columns, and the columns of numbers.

use std::collections::HashSet;
use truing_core::system::log::cells::{Cells, Column, Place};

/// A list of more numbers is a picture or a map: the same as for a cell of a text.
pub const MOST_MEMBERS: usize = 64;
/// More columns than this are no log.
pub const MOST_COLUMNS: usize = 4096;

/// What no file holds: nothing is said of how it was read.
pub const IN_MEMORY: &str = "a table in memory";

/// A column of numbers: NaN where there is none.
pub fn column(values: Vec<f64>) -> Column {
    let text = |row: usize, name: &str| Some((row, name.to_owned()));
    let hole = values.iter().position(|value| value.is_nan());
    let refused = values.iter().position(|value| value.is_infinite());
    let mut column = Column::default();
    column.empty = values.iter().filter(|value| value.is_nan()).count();
    column.hole = hole.and_then(|row| text(row, "nan"));
    column.refused = refused.and_then(|row| text(row, &values[row].to_string()));
    column.values = values;
    column
}

/// The number that a text holds.
pub fn number(text: &str) -> Option<f64> {
    Cells::default().number(text)
}

/// A column of seconds, whatever unit its name speaks of.
pub fn clock(seconds: Vec<f64>) -> Column {
    // A time of day makes it a clock, which is counted in seconds.
    let mut time = Column::default();
    time.push("00:00:00", number);
    let mut column = column(seconds);
    column.form = time.form;
    column
}

/// Names that stand more than once get a number behind them: `speed`, `speed_2`.
pub fn distinct(names: &mut [String]) {
    let mut taken: HashSet<String> = HashSet::new();
    let all: HashSet<String> = names.iter().cloned().collect();
    for name in names {
        if !taken.insert(name.clone()) {
            let free = |candidate: &String| !all.contains(candidate) && !taken.contains(candidate);
            let other = (2..).map(|k| format!("{name}_{k}")).find(free);
            other.unwrap_or_default().clone_into(name);
            taken.insert(name.clone());
        }
    }
}

/// A table of these columns; `written`: the name of the format.
pub fn table(columns: Vec<(String, Column)>, written: &str, told: &[String]) -> Result<Cells, String> {
    let rows = columns.first().map_or(0, |column| column.1.values.len());
    if rows < 2 {
        return Err(format!("holds no table: {rows} rows of numbers were found; a log has many"));
    }
    let (mut header, columns): (Vec<String>, Vec<Column>) = columns.into_iter().unzip();
    distinct(&mut header);
    let read = (written != IN_MEMORY).then(|| format!("The log is read as {written}."));
    let sentences: Vec<String> = read.into_iter().chain(told.iter().cloned()).collect();
    Ok(Cells {
        units: vec![None; header.len()],
        header,
        head: Place { what: "row", number: 1 },
        rows,
        written: written.to_owned(),
        told: (!sentences.is_empty()).then(|| sentences.join(" ")),
        columns,
        ..Cells::default()
    })
}

/// Some of these names, as part of a sentence.
pub fn some_of(names: &[String]) -> String {
    /// So many fit on a line.
    const FEW: usize = 5;
    let shown: Vec<String> = names.iter().take(FEW).map(|name| format!("`{name}`")).collect();
    match names.len().saturating_sub(FEW) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_collide_are_made_distinct() {
        let mut names = ["a", "a", "a_2", "b", "a"].map(str::to_owned);
        distinct(&mut names);
        assert_eq!(names, ["a", "a_3", "a_2", "b", "a_4"]);
    }

    #[test]
    fn a_column_knows_its_empty_and_its_refused_cells() {
        let column = column(vec![1.0, f64::NAN, f64::NEG_INFINITY, f64::NAN]);
        assert_eq!(column.empty, 2);
        assert_eq!(column.hole, Some((1, "nan".into())));
        assert_eq!(column.refused, Some((2, "-inf".into())));
    }

    #[test]
    fn seconds_are_a_clock() {
        assert!(clock(vec![0.0, 0.5]).form.is_some());
    }
}
