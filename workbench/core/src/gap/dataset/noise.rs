//! The sensor's noise, from the high-frequency part of a signal.

use crate::system::log::median;

/// Standard deviation of the noise in `values` from the median of their third differences, which a smooth signal
/// hardly touches. `lag`: the noise is the difference of white noise over `lag` samples (an encoder difference over a
/// window of that many samples); 0: it is white.
///
/// The variance of a third difference is 20 σ² for white noise. For a difference over 1, 2, 3 or more samples it is
/// 35, 14, 21, 20 σ²: the squared coefficients of (1 − z)³(1 − zⁿ), over the 2 of (1 − zⁿ) itself.
pub fn hf_noise(values: &[f64], lag: usize) -> f64 {
    let factor: f64 = match lag {
        1 => 35.0,
        2 => 14.0,
        3 => 21.0,
        _ => 20.0,
    };
    let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
    let mut differences: Vec<f64> = values.windows(4).map(third).filter(|d| d.is_finite()).collect();
    let rough = median(&mut differences) / 0.6745;
    // The mean square of what lies within three of it is twice as efficient as the median; the cut tails of a normal
    // distribution hold 2.67 % of its square.
    let inside: Vec<f64> = differences.into_iter().filter(|d| *d <= 3.0 * rough).collect();
    let mean_square = inside.iter().map(|d| d * d).sum::<f64>() / inside.len().max(1) as f64;
    (mean_square / 0.9733).sqrt() / factor.sqrt()
}
