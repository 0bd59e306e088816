//! How much units differ: a random-effects model yᵢ = μ + uᵢ + eᵢ, var uᵢ = τ², var eᵢ = vᵢ known.

use clap::ValueEnum;
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

/// How τ² is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Restricted maximum likelihood (W. Viechtbauer, J. Educational and Behavioral Statistics 30, 2005, eq. 5).
    #[default]
    Reml,
    /// The generalised Q is what it is expected to be (R. C. Paule and J. Mandel, J. Res. Nat. Bureau of Standards 87, 1982).
    PauleMandel,
    /// One step of it from fixed weights (R. DerSimonian and N. Laird, Controlled Clinical Trials 7, 1986).
    DersimonianLaird,
}

/// The spread of a number between units.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Spread {
    /// μ, the fleet's mean.
    pub mean: f64,
    /// Its 95 % interval (J. Hartung and G. Knapp, Statistics in Medicine 20, 2001).
    pub mean_interval: [f64; 2],
    /// τ, the standard deviation between units.
    pub between: f64,
    /// Its 95 % interval, by profiling Q (W. Viechtbauer, Statistics in Medicine 26, 2007).
    pub between_interval: [f64; 2],
    /// Units.
    pub units: usize,
}

/// One unit: its number, and the variance of it.
pub type Unit = (f64, f64);

/// The sums over units with the weights 1/(vᵢ + τ²).
struct Weighed {
    /// Σw, Σw², Σw³.
    sums: [f64; 3],
    mean: f64,
    /// Σw(y − μ)², Σw²(y − μ)².
    squares: [f64; 2],
}

impl Weighed {
    fn with(units: &[Unit], tau2: f64) -> Self {
        let weight = |v: f64| 1.0 / (v + tau2);
        let sum = |power: i32| units.iter().map(|unit| weight(unit.1).powi(power)).sum::<f64>();
        let sums = [sum(1), sum(2), sum(3)];
        let mean = units.iter().map(|(y, v)| weight(*v) * y).sum::<f64>() / sums[0];
        let square =
            |power: i32| units.iter().map(|(y, v)| weight(*v).powi(power) * (y - mean).powi(2)).sum();
        Self { sums, mean, squares: [square(1), square(2)] }
    }
}

/// The spread of at least two units.
pub fn spread(units: &[Unit], method: Method) -> Option<Spread> {
    let freedom = units.len().checked_sub(1).filter(|freedom| *freedom > 0)? as f64;
    let tau2 = match method {
        Method::Reml => restricted(units),
        Method::PauleMandel => with_q(units, freedom),
        Method::DersimonianLaird => moments(units, freedom),
    };
    let at = Weighed::with(units, tau2);
    let half = StudentsT::new(0.0, 1.0, freedom).ok()?.inverse_cdf(0.975)
        * (at.squares[0] / (freedom * at.sums[0])).sqrt();
    let quantile = |p: f64| ChiSquared::new(freedom).ok().map(|chi| chi.inverse_cdf(p));
    Some(Spread {
        mean: at.mean,
        mean_interval: [at.mean - half, at.mean + half],
        between: tau2.sqrt(),
        between_interval: [with_q(units, quantile(0.975)?).sqrt(), with_q(units, quantile(0.025)?).sqrt()],
        units: units.len(),
    })
}

/// DerSimonian and Laird, eq. 8.
fn moments(units: &[Unit], freedom: f64) -> f64 {
    let Weighed { sums: [w, w2, _], squares: [q, _], .. } = Weighed::with(units, 0.0);
    ((q - freedom) / (w - w2 / w)).max(0.0)
}

/// The τ² ≥ 0 at which Q(τ²) is this; Q falls.
fn with_q(units: &[Unit], wanted: f64) -> f64 {
    zero(units, |at| at.squares[0] - wanted)
}

/// The τ² ≥ 0 at which the restricted likelihood has its peak: its slope is y'PPy − tr P (Viechtbauer 2005, eq. 10).
fn restricted(units: &[Unit]) -> f64 {
    zero(units, |at| at.squares[1] - (at.sums[0] - at.sums[1] / at.sums[0]))
}

/// Where a function of τ² that begins positive crosses zero; 0 if it begins below. The interval is halved to the last bit.
fn zero(units: &[Unit], of: impl Fn(&Weighed) -> f64) -> f64 {
    let positive = |tau2: f64| of(&Weighed::with(units, tau2)) > 0.0;
    if !positive(0.0) {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, units.iter().map(|unit| unit.1).fold(f64::MIN_POSITIVE, f64::max));
    while positive(high) && high.is_finite() {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        *(if positive(middle) { &mut low } else { &mut high }) = middle;
    }
    0.5 * (low + high)
}
