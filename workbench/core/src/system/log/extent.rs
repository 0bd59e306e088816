//! What the numbers of a column tell.

use super::cells::Cells;
use super::steps::median;

/// Rows that are closer than this, s, are in another unit than their column says: no log of a motor has 500,000 a
/// second. Chosen by judgement; not studied.
const CLOSEST_S: f64 = 2e-6;
/// Rows whose steps tell the usual one. Chosen by judgement; not studied.
const SAMPLE: usize = 1000;

/// What the numbers of a column tell.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Least number.
    pub min: f64,
    /// Greatest number.
    pub max: f64,
    /// No number has decimals.
    pub whole: bool,
    /// Median of the differences from row to row that are not 0; NaN if there is none.
    pub step: f64,
}

impl Extent {
    /// Of one column; `None` if it holds no number.
    pub fn of(values: &[f64]) -> Option<Self> {
        let (mut steps, mut before) = (Vec::new(), None);
        let none = Self { min: f64::INFINITY, max: f64::NEG_INFINITY, whole: true, step: f64::NAN };
        let seen = |extent: Self, value: &f64| {
            steps.extend(
                before.replace(*value).map(|before: f64| (value - before).abs()).filter(|step| *step > 0.0),
            );
            let (min, max) = (extent.min.min(*value), extent.max.max(*value));
            Self { min, max, whole: extent.whole && value.fract() == 0.0, step: f64::NAN }
        };
        let extent = values.iter().filter(|value| value.is_finite()).fold(none, seen);
        let step = if steps.is_empty() { f64::NAN } else { median(&mut steps) };
        before.map(|_| Self { step, ..extent })
    }

    /// The number that is farthest from 0.
    pub fn most(&self) -> f64 {
        self.min.abs().max(self.max.abs())
    }
}

/// A time in this unit has impossibly many rows a second.
pub fn is_too_fast(cells: &Cells, index: usize, unit: f64) -> bool {
    let values = cells.values(index);
    let extent = Extent::of(&values[..values.len().min(SAMPLE)]);
    extent.is_some_and(|extent| extent.step * unit < CLOSEST_S)
}
