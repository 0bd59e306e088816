//! The one rule by which a name is accepted: what a larger set gains must be beyond chance.
//!
//! Gains are counted in twice the logarithm of the likelihood: χ² over a record, n·ln(mean square) over a table, whose noise
//! is unknown. Both times what the residuals are more than independent noise widens the limits: over-dispersion and the
//! correlation of neighbours.

/// Gain that a name must bring. The evidence of 2 in the log-likelihood that Kass and Raftery (J. Am. Stat. Assoc. 90, 1995)
/// call very strong is 10; with a dozen candidates the chance of one false name stays below 1 %.
pub const WORTH: f64 = 12.0;
/// Sets within this of the best explain the data as well.
const TIED: f64 = 10.0;

/// The gain that a name must bring where the residuals are so far from independent noise.
pub fn worth(dispersion: f64) -> f64 {
    WORTH * dispersion
}

/// The difference below which two sets are a tie where the residuals are so far from independent noise.
pub fn tied(dispersion: f64) -> f64 {
    TIED * dispersion
}
