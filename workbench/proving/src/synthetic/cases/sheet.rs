//! A log as columns, and its CSV.

use std::fmt::Write as _;

/// Columns of equal length by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheet {
    /// Name and values, in the order of the file.
    pub columns: Vec<(&'static str, Vec<f64>)>,
}

impl Sheet {
    /// Adds a column.
    pub fn add(&mut self, name: &'static str, values: Vec<f64>) {
        self.columns.push((name, values));
    }

    /// A column, empty when there is none of that name.
    pub fn column(&self, name: &str) -> &[f64] {
        self.columns.iter().find(|column| column.0 == name).map_or(&[], |column| &column.1)
    }

    /// Appends the rows of a sheet with the same columns.
    pub fn append(&mut self, other: Sheet) {
        if self.columns.is_empty() {
            return *self = other;
        }
        for (column, (_, values)) in self.columns.iter_mut().zip(other.columns) {
            column.1.extend(values);
        }
    }

    /// The file's text: nine significant digits, far below any sensor's resolution.
    pub fn to_csv(&self) -> String {
        let names: Vec<&str> = self.columns.iter().map(|column| column.0).collect();
        let mut text = names.join(",");
        text.push('\n');
        for row in 0..self.columns.first().map_or(0, |column| column.1.len()) {
            for (k, (_, values)) in self.columns.iter().enumerate() {
                let comma = if k == 0 { "" } else { "," };
                let _ = write!(text, "{comma}{}", truing_core::text::figures::rounded(values[row], 9));
            }
            text.push('\n');
        }
        text
    }
}
