//! Where simulation and data disagree.

use crate::hypothesis::Hypothesis;
use crate::outcome::Where;

/// Regions that hold most of the squared error.
pub fn places(_given: &Hypothesis, _x: &[f64]) -> Vec<Where> {
    Vec::new()
}
