//! By how much a number scatters from log to log beyond the standard deviations that its logs tell.
//!
//! What a log tells is the scatter that its noise makes, with what it does not see of the motor. Real scatter is larger (temperature,
//! another stretch of the shaft) or smaller (what a data sheet contributes is the same every day). Each unit shows it in few logs, the
//! fleet in many: the variances of the units are drawn towards a common one by an empirical Bayes rule (G. K. Smyth, Statistical
//! Applications in Genetics and Molecular Biology 3, 2004, sections 3 and 6.2), by which t statistics stay exact with more degrees of freedom.

use statrs::function::gamma::{digamma, ln_gamma};

/// Fewer units tell nothing of a common variance.
const FEWEST: usize = 3;
/// Beyond it a t distribution is a normal one.
const MANY: f64 = 1e6;

/// The scatter that units have in common: s₀² with d₀ degrees of freedom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Common {
    /// s₀², 1 if the logs tell their scatter right.
    pub variance: f64,
    /// d₀: 0, each unit stands for itself; infinite, all scatter alike.
    pub freedom: f64,
}

impl Common {
    /// Of the variances of units, each with its degrees of freedom.
    pub fn of(units: &[(f64, f64)]) -> Self {
        let told: Vec<(f64, f64)> = units.iter().copied().filter(|(s2, d)| *s2 > 0.0 && *d > 0.0).collect();
        if told.len() < FEWEST {
            return Self { variance: 1.0, freedom: 0.0 };
        }
        let n = told.len() as f64;
        let e: Vec<f64> = told.iter().map(|(s2, d)| s2.ln() - digamma(0.5 * d) + (0.5 * d).ln()).collect();
        let mean = e.iter().sum::<f64>() / n;
        let over = |(e, (_, d)): (&f64, &(f64, f64))| n / (n - 1.0) * (e - mean).powi(2) - trigamma(0.5 * d);
        let excess = e.iter().zip(&told).map(over).sum::<f64>() / n;
        if excess <= 0.0 {
            return Self { variance: mean.exp(), freedom: f64::INFINITY };
        }
        let half = inverse_trigamma(excess);
        Self { variance: (mean + digamma(half) - half.ln()).exp(), freedom: 2.0 * half }
    }

    /// The variance of a unit drawn towards the common one, with its degrees of freedom.
    pub fn moderated(&self, variance: f64, freedom: f64) -> (f64, f64) {
        match self.freedom > MANY {
            true => (self.variance, f64::INFINITY),
            false => {
                let all = self.freedom + freedom;
                ((self.freedom * self.variance + freedom * variance) / all, all)
            }
        }
    }
}

/// ψ'(x) for x > 0: recurrence up to 10, then the asymptotic series (Abramowitz and Stegun, 6.4.6 and 6.4.12).
pub fn trigamma(x: f64) -> f64 {
    if x < 10.0 {
        return trigamma(x + 1.0) + 1.0 / (x * x);
    }
    let y = 1.0 / (x * x);
    1.0 / x + 0.5 * y + y / x * (1.0 / 6.0 - y * (1.0 / 30.0 - y * (1.0 / 42.0 - y / 30.0)))
}

/// The x > 0 with ψ'(x) = y: ψ' falls, so the interval is halved, on a scale of logarithms.
fn inverse_trigamma(y: f64) -> f64 {
    let (mut low, mut high) = (1e-8_f64.ln(), 1e8_f64.ln());
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        *(if trigamma(middle.exp()) > y { &mut low } else { &mut high }) = middle;
    }
    (0.5 * (low + high)).exp()
}

/// Two-sided p value of a t statistic.
pub fn p_of_t(t: f64, freedom: f64) -> f64 {
    if freedom > MANY {
        return statrs::function::erf::erfc(t.abs() / 2f64.sqrt());
    }
    let x = freedom / (freedom + t * t);
    match x > 0.0 {
        true => statrs::function::beta::beta_reg(0.5 * freedom, 0.5, x.min(1.0)),
        // Beyond what a number holds: the tail's leading term.
        false => (0.5 * freedom * (freedom.ln() - 2.0 * t.abs().ln()) - ln_gamma(0.5 * freedom)).exp(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{ChiSquared, Distribution};

    #[test]
    fn trigamma_and_its_inverse_are_those_of_the_tables() {
        assert!((trigamma(1.0) - std::f64::consts::PI.powi(2) / 6.0).abs() < 1e-12);
        assert!((trigamma(0.5) - std::f64::consts::PI.powi(2) / 2.0).abs() < 1e-12);
        for x in [0.01, 0.7, 9.0, 300.0] {
            assert!((inverse_trigamma(trigamma(x)) / x - 1.0).abs() < 1e-8, "{x}");
        }
    }

    #[test]
    fn t_values_have_the_p_values_of_the_tables() {
        // Two-sided 5 % points of Student's t: 2.228 with 10 degrees of freedom, 1.960 with infinitely many.
        assert!((p_of_t(2.228_138_852, 10.0) - 0.05).abs() < 1e-8);
        assert!((p_of_t(-1.959_963_985, f64::INFINITY) - 0.05).abs() < 1e-8);
        assert_eq!(p_of_t(0.0, 7.0), 1.0);
    }

    #[test]
    fn a_common_scatter_is_found_from_units_of_few_logs() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (d, d0, s0) = (18.0, 12.0, 0.5);
        let mut chi = |d: f64| ChiSquared::new(d).unwrap().sample(&mut rng) / d;
        let units: Vec<(f64, f64)> = (0..4000).map(|_| (s0 / chi(d0) * chi(d), d)).collect();
        let common = Common::of(&units);
        assert!((common.variance / s0 - 1.0).abs() < 0.05, "{common:?}");
        assert!((common.freedom / d0 - 1.0).abs() < 0.2, "{common:?}");
        let alike: Vec<(f64, f64)> = (0..9).map(|k| (2.0 + 0.01 * f64::from(k), d)).collect();
        assert_eq!(Common::of(&alike).freedom, f64::INFINITY);
        assert_eq!(Common::of(&alike[..2]), Common { variance: 1.0, freedom: 0.0 });
    }
}
