//! How far a column steps from row to row: what an excursion is measured by.

use std::ops::RangeInclusive;

/// An excursion is so many times as far as this share of a column's steps from row to row. Chosen by judgement; not
/// studied.
const FAR: f64 = 4.0;
const ORDINARY: f64 = 0.95;
/// And this part of the column's range: what is less harms nobody. Chosen by judgement; not studied.
pub const VISIBLE: f64 = 0.12;
/// More rows do not tell better what is ordinary. Chosen by judgement; not studied.
const ROWS: usize = 50_000;

/// Steps of a column.
pub struct Steps<'a> {
    /// Rows in which the input changes.
    changes: &'a [bool],
    /// An excursion goes farther.
    pub far: f64,
    /// And farther than this beside a change of the input.
    answering: f64,
    /// From the 2nd to the 98th percentile.
    pub span: f64,
    /// Most steps are shorter.
    pub ordinary: f64,
}

impl<'a> Steps<'a> {
    /// Of a column, with the rows in which the input changes.
    pub fn of(values: &[f64], changes: &'a [bool]) -> Option<Self> {
        let sizes = |wanted: &dyn Fn(usize) -> bool| {
            let rows = looked_at(1, values.len()).filter(|row| wanted(*row));
            quantile(rows.map(|row| (values[row] - values[row - 1]).abs()).collect(), ORDINARY)
        };
        let ordinary = sizes(&|_| true)?;
        let answers = sizes(&|row| changes[row] || changes[row - 1]).unwrap_or(0.0);
        let below = |share| quantile(looked_at(0, values.len()).map(|row| values[row]).collect(), share);
        let span = below(0.98)? - below(0.02)?;
        let far = (FAR * ordinary).max(VISIBLE * span);
        (span > 0.0).then_some(Self { changes, far, answering: far.max(2.5 * answers), span, ordinary })
    }

    /// What an excursion over these rows exceeds.
    pub fn far_over(&self, rows: RangeInclusive<usize>) -> f64 {
        let near = self.changes[rows].iter().any(|change| *change);
        if near { self.answering } else { self.far }
    }
}

/// As many rows as tell what is ordinary.
pub fn looked_at(from: usize, to: usize) -> impl Iterator<Item = usize> {
    (from..to).step_by(to / ROWS + 1)
}

/// The median; 0 without values.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Of the values that are finite.
pub fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.retain(|value| value.is_finite());
    let rank = ((values.len().checked_sub(1)?) as f64 * share) as usize;
    Some(*values.select_nth_unstable_by(rank, f64::total_cmp).1)
}
