//! The columns of a sheet as quantities in SI units.

use super::column_plan::Origin;
use super::formula::Formula;
use super::names::Quantity;
use super::read::Sheet;
use crate::text::input_error::InputError;

impl Sheet<'_> {
    /// A column in SI units, if the file has it; NaN where a cell is empty. What only this quantity needs is taken.
    pub(super) fn column(&mut self, quantity: Quantity) -> Result<Option<Vec<f64>>, InputError> {
        let Some(origin) = self.plan.origin(quantity) else { return Ok(None) };
        match origin.formula {
            Formula::Scaled { index, factor }
                if index < self.cells.columns.len() && self.uses(index) == 1 =>
            {
                let factor = origin.unit * factor;
                self.check_words(origin)?;
                let mut values = std::mem::take(&mut self.cells.columns[index].values);
                if let Some(row) = values.iter().position(|value| (value * factor).is_infinite()) {
                    return Err(self.infinite(row, values[row] * factor, quantity));
                }
                values.iter_mut().for_each(|value| *value *= factor);
                Ok(Some(values))
            }
            _ => self.copy(quantity),
        }
    }

    /// The same, and the cells stay.
    pub(super) fn copy(&self, quantity: Quantity) -> Result<Option<Vec<f64>>, InputError> {
        let Some(origin) = self.plan.origin(quantity) else { return Ok(None) };
        let (indices, mut cells) = (origin.formula.indices(), Vec::new());
        let refused = self.refused(origin).map_or(self.cells.rows, |(_, row)| row);
        let mut values = Vec::with_capacity(refused);
        for row in 0..refused {
            cells.clear();
            // The column behind the last one is the number of the row.
            let columns = indices.iter().map(|index| self.cells.columns.get(*index));
            cells.extend(columns.map(|column| column.map_or(row as f64, |column| column.values[row])));
            let value = origin.formula.value(&cells, origin.unit);
            if !value.is_finite() && !cells.iter().any(|cell| cell.is_nan()) {
                return Err(self.infinite(row, value, quantity));
            }
            values.push(value);
        }
        self.check_words(origin).map(|()| Some(values))
    }

    fn infinite(&self, row: usize, value: f64, quantity: Quantity) -> InputError {
        let origin = self.plan.origin(quantity);
        let name = origin.map_or("", |origin| &origin.name);
        let what =
            format!("--columns, `{name}` gives {value} here; correct the expression or remove the row");
        self.wrong(row, what)
    }

    /// Index and row of the first cell that an origin cannot be computed from.
    fn refused(&self, origin: &Origin) -> Option<(usize, usize)> {
        let row = |index: &usize| Some((*index, self.cells.columns.get(*index)?.refused.as_ref()?.0));
        origin.formula.indices().iter().filter_map(row).min_by_key(|known| known.1)
    }

    fn check_words(&self, origin: &Origin) -> Result<(), InputError> {
        let Some((index, row)) = self.refused(origin) else { return Ok(()) };
        let cell = self.cells.columns[index].refused.as_ref().map_or("", |known| &known.1);
        let why = match self.cells.number(cell) {
            Some(_) => format!("`{cell}` is not a finite number; remove the row"),
            None => self.no_number(cell),
        };
        Err(self.wrong(row, format!("column {}: {why}", self.cells.header[index])))
    }

    fn no_number(&self, cell: &str) -> String {
        let clock = cell.matches(':').count() > 0 && cell.starts_with(|first: char| first.is_ascii_digit());
        if clock {
            return format!(
                "`{cell}` is a time of day; write seconds, or leave the column out and map t_s=row*SECONDS"
            );
        }
        let comma = self.cells.dialect.as_ref().is_some_and(|dialect| dialect.decimal_comma);
        let (sign, others) = match (comma, cell.contains('.'), cell.contains(',')) {
            (true, true, _) => ("point", "commas"),
            (false, _, true) => ("comma", "points"),
            _ => return format!("`{cell}` is not a number; correct the cell or remove the row"),
        };
        format!("`{cell}` has a {sign} where the file has decimal {others}; write all numbers in one way")
    }
}
