//! The variables of MATLAB as a table: vectors of one length are columns.

use crate::naming::{self, MOST_MEMBERS};
use std::collections::BTreeMap;
use truing_core::system::log::cells::Cells;

/// A structure in a structure in a structure.
pub const DEEPEST: usize = 16;

/// A variable that holds numbers.
pub struct Variable {
    /// Its name; that of a member of a structure: `a.b`.
    pub name: String,
    /// Length in each dimension.
    pub dims: Vec<usize>,
    /// Column after column.
    pub values: Vec<f64>,
}

/// What a file holds.
#[derive(Default)]
pub struct Variables {
    /// Its numbers.
    pub list: Vec<Variable>,
    /// What is of another kind.
    pub left_out: Vec<String>,
    /// How the file was read, in sentences.
    pub told: Vec<String>,
}

impl Variable {
    /// Rows and columns, where it is a matrix; without dimensions of one.
    fn shape(&self) -> Option<(usize, usize)> {
        let longer: Vec<usize> = self.dims.iter().copied().filter(|length| *length != 1).collect();
        match longer[..] {
            [rows] => Some((rows, 1)),
            [rows, columns] => Some((rows, columns)),
            _ => None,
        }
    }

    /// The columns of so many rows that it holds.
    fn columns(&self, rows: usize) -> Option<Vec<Vec<f64>>> {
        let (height, width) = self.shape()?;
        if height == rows && width <= MOST_MEMBERS {
            return Some(self.values.chunks(rows).map(<[f64]>::to_vec).collect());
        }
        let lying = width == rows && height <= MOST_MEMBERS;
        let row = |k: usize| self.values.iter().skip(k).step_by(height).copied().collect();
        lying.then(|| (0..height).map(row).collect())
    }
}

impl Variables {
    /// The table of those that have the length that most have.
    pub fn cells(mut self, written: &str) -> Result<Cells, String> {
        let mut lengths: BTreeMap<usize, usize> = BTreeMap::new();
        for (rows, columns) in self.list.iter().filter_map(Variable::shape) {
            if columns == 1 {
                *lengths.entry(rows).or_default() += 1;
            }
        }
        let matrix = || self.list.iter().filter_map(Variable::shape).map(|shape| shape.0.max(shape.1)).max();
        let most = lengths.iter().max_by_key(|known| (*known.1, *known.0)).map(|known| *known.0);
        let Some(rows) = most.filter(|rows| *rows > 1).or_else(matrix) else {
            return Err(
                "holds no vectors of numbers; save time, input and output as vectors of one length".into()
            );
        };
        let mut columns = Vec::new();
        for variable in &self.list {
            match variable.columns(rows) {
                Some(mut own) if own.len() == 1 => columns.push((variable.name.clone(), own.remove(0))),
                Some(own) => {
                    let named = |(k, column)| (format!("{}_{k}", variable.name), column);
                    columns.extend(own.into_iter().enumerate().map(named));
                }
                None if variable.values.len() > 1 => self.left_out.push(variable.name.clone()),
                None => {}
            }
        }
        if !self.left_out.is_empty() {
            self.told.push(format!(
                "Left out, because they are no vectors of {rows} numbers: {}.",
                naming::some_of(&self.left_out)
            ));
        }
        let columns = columns.into_iter().map(|(name, values)| (name, naming::column(values))).collect();
        naming::table(columns, written, &self.told)
    }
}
