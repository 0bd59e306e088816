//! The numbers of a file, column by column.

use super::clock::Form;
use super::dialect::Dialect;
use super::text::{missing, number};
use crate::text::input_error::InputError;
use std::fmt::Display;

/// A place in a file: `line 12`.
#[derive(Clone, Copy, Debug, Default, derive_more::Display)]
#[display("{what} {number}")]
pub struct Place {
    /// What the file has many of.
    pub what: &'static str,
    /// Which of them, from 1.
    pub number: u64,
}

/// The cells of a file with their places.
#[derive(Clone, Debug, Default)]
pub struct Cells {
    /// Names of the columns.
    pub header: Vec<String>,
    /// Units below the names, where the file has such a row.
    pub units: Vec<Option<String>>,
    /// Where the names stand.
    pub head: Place,
    /// Number of rows.
    pub rows: usize,
    /// Rows before which the header is repeated: the logger was started anew.
    pub restarts: Vec<usize>,
    /// How the file is written, in some words.
    pub written: String,
    /// How it was read, in a sentence, where that is worth one.
    pub told: Option<String>,
    /// How a text is written.
    pub dialect: Option<Dialect>,
    /// The columns.
    pub columns: Vec<Column>,
    /// Row and the number of its place, where the rows after it follow one by one; without any, rows are counted from 1.
    pub places: Vec<(usize, u64)>,
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
    /// Adds a cell; `number`: what it holds if it is one.
    pub fn push(&mut self, cell: &str, number: impl Fn(&str) -> Option<f64>) {
        let row = self.values.len();
        let mut value = match &self.form {
            None => number(cell),
            Some(form) => form.number(cell, &number),
        };
        if value.is_none() && !self.begun && !missing(cell) {
            self.form = Form::of(cell);
            value = self.form.as_ref().and_then(|form| form.number(cell, &number));
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
    /// Where a row stands.
    pub fn place(&self, row: usize) -> Place {
        let at = self.places.partition_point(|known| known.0 <= row).saturating_sub(1);
        let number = self.places.get(at).map_or(1 + row as u64, |(from, n)| n + (row - from) as u64);
        Place { number, ..self.head }
    }

    /// The names of the columns cannot be used.
    pub fn wrong_names(&self, source: &str, what: impl Display) -> InputError {
        InputError::at(source, self.head, what)
    }

    /// The number in a cell.
    pub fn number(&self, cell: &str) -> Option<f64> {
        self.dialect.as_ref().map_or_else(|| number(cell), |dialect| dialect.number(cell))
    }

    /// Adds a row to the columns that are there.
    pub fn push<'c>(&mut self, number: u64, cell: impl Fn(usize) -> &'c str, dialect: &Dialect) {
        for (index, column) in self.columns.iter_mut().enumerate() {
            column.push(cell(index), |cell| dialect.number(cell));
        }
        let follows = |known: &(usize, u64)| known.1 + (self.rows - known.0) as u64 == number;
        if !self.places.last().is_some_and(follows) {
            self.places.push((self.rows, number));
        }
        self.rows += 1;
    }

    /// The numbers of a column, NaN where there is none.
    pub fn values(&self, index: usize) -> &[f64] {
        &self.columns[index].values
    }

    /// Signals may stand one behind the other, each from the first time to the last.
    pub fn sort_by_time(&mut self) {
        let time = &self.columns[0].values;
        let mut order: Vec<usize> = (0..self.rows).collect();
        order.sort_by(|a, b| time[*a].total_cmp(&time[*b]));
        self.places = order.iter().map(|row| self.place(*row).number).enumerate().collect();
        for column in &mut self.columns {
            column.values = order.iter().map(|row| column.values[*row]).collect();
            let found = column.hole.iter_mut().chain(&mut column.refused);
            found.for_each(|found| found.0 = order.iter().position(|row| *row == found.0).unwrap_or(0));
        }
    }
}
