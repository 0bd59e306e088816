//! A table of settled speeds: a log without a time.

use super::names::Quantity;
use super::read::Sheet;
use super::{Input, Table};
use crate::text::input_error::InputError;

/// Fewer points than this make no steady-state curve. Chosen by judgement; not studied.
const FEWEST_POINTS: usize = 4;
/// Blocks of one input in which the speed goes somewhere, by which rows without a time are a record. Chosen by
/// judgement; not studied.
const BLOCKS: usize = 3;
/// Rows of such a block at least, and how far the speed goes in it, relative to all speeds. Chosen by judgement; not
/// studied.
const BLOCK: (usize, f64) = (5, 0.2);

impl Sheet<'_> {
    /// The points of the curve.
    pub(super) fn table(&mut self, notes: &mut Vec<String>) -> Result<Table, InputError> {
        let (input, u_v) = self.input()?;
        let omega = self.column(Quantity::AngularSpeed)?;
        let omega = omega.ok_or_else(|| self.lacks("omega_rad_s (and no t_s: a steady-state table)"))?;
        let pairs = u_v.into_iter().zip(omega);
        let (kept, holes): (Vec<_>, Vec<_>) = pairs.enumerate().partition(|(_, (u, w))| !(u + w).is_nan());
        let holes: Vec<usize> = holes.into_iter().map(|hole| hole.0).collect();
        self.check_share(&holes, &(0..self.cells.rows).collect::<Vec<_>>())?;
        notes.extend(
            (!holes.is_empty()).then(|| format!("{} rows with empty cells are left out.", holes.len())),
        );
        let (u_v, omega_rad_s): (Vec<f64>, Vec<f64>) = kept.into_iter().map(|point| point.1).unzip();
        if input != Input::Voltage {
            let what = "a steady-state table needs a voltage (u_v); add t_s for other inputs";
            return Err(InputError::file(self.source, what));
        }
        if !self.time_stated {
            let what = "No column is the time: the rows are read as settled speeds. If they are a record, add t_s=row*SECONDS to --columns.";
            if is_record(&u_v, &omega_rad_s) {
                let what = "has no time, and its speeds change while the input stays the same, as in a record over time: give the \
                            step of its rows with --columns \"t_s=row*SECONDS\", or write t_s=none if each row is a settled speed";
                return Err(InputError::file(self.source, what));
            }
            notes.push(what.into());
        }
        if u_v.len() < FEWEST_POINTS {
            let what =
                format!("has {} points; a steady-state curve needs at least {FEWEST_POINTS}", u_v.len());
            return Err(InputError::file(self.source, what));
        }
        Ok(Table {
            source: self.source.to_owned(),
            u_v,
            omega_rad_s,
            speed_unit_rad_s: self.factor(Quantity::AngularSpeed),
            names: self.plan.names.clone(),
        })
    }
}

/// Speeds that go somewhere while the input stays the same.
fn is_record(input: &[f64], speed: &[f64]) -> bool {
    let (least, most) = speed.iter().fold((0.0_f64, 0.0_f64), |ends, w| (ends.0.min(*w), ends.1.max(*w)));
    let mut at = 0;
    let goes = input.chunk_by(|a, b| a == b).filter(|block| {
        let (first, last) = (at, at + block.len() - 1);
        at = last + 1;
        block.len() >= BLOCK.0 && (speed[last] - speed[first]).abs() > BLOCK.1 * (most - least)
    });
    goes.count() >= BLOCKS
}
