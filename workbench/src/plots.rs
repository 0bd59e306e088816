//! Curves for the report.

use crate::hypothesis::Hypothesis;
use crate::outcome::Plot;
use crate::search::Scored;

/// All plots.
pub fn all(_given: &Hypothesis, _x: &[f64], _kept: &Scored) -> Vec<Plot> {
    Vec::new()
}
