//! Measured minus simulated: metrics and the structure of what is left.

use nalgebra::{DMatrix, DVector};

/// Root of the mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The largest magnitude.
pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0_f64, |most, value| most.max(value.abs()))
}

/// 100·(1 − ‖y − ŷ‖/‖y − ȳ‖): the share of the measured variation that the simulation explains, in %.
pub fn fit_percent(measured: &[f64], predicted: &[f64]) -> f64 {
    let mean = measured.iter().sum::<f64>() / measured.len().max(1) as f64;
    let off: f64 = measured.iter().zip(predicted).map(|(y, p)| (y - p) * (y - p)).sum();
    let all: f64 = measured.iter().map(|y| (y - mean) * (y - mean)).sum();
    100.0 * (1.0 - (off / all.max(1e-300)).sqrt())
}

/// By how much correlation inflates the variance of a mean: the largest ratio, over blocks of 4, 16 and a 60th of the
/// samples, of the variance of block means to what independent residuals would give. 1 for white residuals.
pub fn inflation(residuals: &[f64]) -> f64 {
    let mean_square = residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len().max(1) as f64;
    [4, 16, (residuals.len() / 60).max(1)]
        .into_iter()
        .map(|length| block_ratio(residuals, length, mean_square))
        .fold(1.0, f64::max)
}

fn block_ratio(residuals: &[f64], length: usize, mean_square: f64) -> f64 {
    let blocks = residuals.chunks_exact(length);
    let count = blocks.len();
    if count < 8 || mean_square <= 0.0 {
        return 1.0;
    }
    let means: f64 = blocks.map(|block| (block.iter().sum::<f64>() / length as f64).powi(2)).sum();
    means / count as f64 * length as f64 / mean_square
}

/// Weights of the best sum of `parts` and a constant, and the rms of what it leaves of `values`, relative to their variation.
pub fn best_sum(parts: &[Vec<f64>], values: &[f64]) -> Option<(DVector<f64>, f64)> {
    let values = DVector::from_column_slice(values);
    let part = |row: usize, column: usize| parts.get(column).map_or(1.0, |part| part[row]);
    let matrix = DMatrix::from_fn(values.len(), parts.len() + 1, part);
    let variation = values.add_scalar(-values.mean()).norm();
    let weights = matrix.clone().svd(true, true).solve(&values, 1e-9 * matrix.norm()).ok()?;
    let left = (values - matrix * &weights).norm() / variation;
    (variation > 0.0).then_some((weights, left))
}
