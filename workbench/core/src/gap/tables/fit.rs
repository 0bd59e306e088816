//! One set of effects fitted to a table of settled speeds, with the base parameters as nuisances.
//!
//! Minimised is Σ((y − ŷ)/σ)² + Σ(δ/tolerance)², δ = ln(fitted/nominal) of the base parameters. σ is not known beforehand:
//! it starts at the residual of the start and is found by repetition, so that a model that lacks something does not bend
//! its base to hide it. The cost of a fit is therefore that of a Gaussian with the noise unknown, n·ln(mean square), with
//! the priors.

use super::rows::Rows;
use crate::gap::fit::Fit;
use crate::gap::fit::hypothesis::Hypothesis;
use crate::gap::fit::problem::{Problem, clipped, dot};
use crate::gap::fit::scored::Scored;
use crate::gap::fit::solver::{self, Schedule, solve};
use nalgebra::DMatrix;

/// A set of effects fitted to rows, with its score.
pub type Set<'a> = Scored<'a, Rows>;

/// A descent ends at a relative decrease of 1e-5: ten times finer than over a record, since some dozen rows cost little. Its
/// figures are reported as they come out, without a final fit on a finer grid, so that no gain is negligible.
const SCHEDULE: Schedule = Schedule { iterations: 20, slow: 1e-5, negligible: 0.0 };
/// Repetitions at most that look for σ. A budget of computing time, chosen by judgement.
const REPETITIONS: usize = 3;
/// Numbers that move less than this part of their scales have settled. Chosen by judgement; not studied.
const SETTLED: f64 = 1e-6;

/// The residuals of a hypothesis for a given noise.
struct Weighted<'h, 'a> {
    hypothesis: &'h Hypothesis<'a, Rows>,
    sigma: f64,
}

impl Problem for Weighted<'_, '_> {
    fn residuals(&mut self, x: &[f64], out: &mut Vec<f64>) {
        let misfit = self.hypothesis.dataset.misfit(&self.hypothesis.plant(x));
        out.clear();
        out.extend(misfit.iter().map(|r| r / self.sigma));
        out.extend(self.hypothesis.priors(x));
    }

    fn bounds(&self, slot: usize) -> (f64, f64) {
        self.hypothesis.bounds(slot)
    }

    fn step(&self, slot: usize) -> f64 {
        self.hypothesis.step(slot)
    }

    /// All: a table costs so little that no column has to follow.
    fn bending(&self) -> usize {
        self.hypothesis.slots.len()
    }
}

/// Mean squared residual of the fitted rows, (rad/s)².
pub fn mean_square(hypothesis: &Hypothesis<Rows>, x: &[f64]) -> f64 {
    let misfit = hypothesis.dataset.misfit(&hypothesis.plant(x));
    dot(&misfit, &misfit) / misfit.len().max(1) as f64
}

/// The best fit over several starts.
pub fn best(hypothesis: &Hypothesis<Rows>, starts: &[Vec<f64>]) -> Option<Fit> {
    let fits = starts.iter().map(|start| descended(hypothesis, start));
    fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// σ follows the residual: a fit that improves tightens the data against the priors.
fn descended(hypothesis: &Hypothesis<Rows>, start: &[f64]) -> Fit {
    let mut problem = Weighted { hypothesis, sigma: 1.0 };
    let places = start.iter().enumerate();
    let mut x: Vec<f64> = places.map(|(k, v)| clipped(&problem, k, *v)).collect();
    for _ in 0..REPETITIONS {
        problem.sigma = (mean_square(hypothesis, &x) + hypothesis.dataset.resolution.powi(2)).sqrt();
        let before = std::mem::take(&mut x);
        x = solve(&mut problem, &before, &SCHEDULE).x;
        if x.iter().zip(&before).all(|(a, b)| (a - b).abs() < SETTLED) {
            break;
        }
    }
    let samples = hypothesis.dataset.count();
    let mean_square = mean_square(hypothesis, &x);
    let prior: f64 = hypothesis.priors(&x).map(|z| z * z).sum();
    Fit {
        cost: samples as f64 * (mean_square + hypothesis.dataset.resolution.powi(2)).ln() + prior,
        chi2: mean_square * samples as f64,
        samples,
        x,
    }
}

impl Set<'_> {
    /// Mean squared residual of the fitted rows, (rad/s)².
    pub fn mean_square(&self) -> f64 {
        self.fit.chi2 / self.fit.samples.max(1) as f64
    }

    /// How much less independent the residuals are than their number says: (1 + ρ)/(1 − ρ), ρ between neighbours.
    pub fn inflation(&self) -> f64 {
        let rows = self.hypothesis.dataset;
        let residual = rows.fitted_only(&rows.residual(&self.plant()));
        let power: f64 = residual.iter().map(|r| r * r).sum();
        let pairs: f64 = residual.windows(2).map(|w| w[0] * w[1]).sum();
        // At 0.8 the residuals are worth a ninth of their number: more is a missing effect, not noise. Judgement; not studied.
        let correlation = (pairs / power.max(f64::MIN_POSITIVE)).clamp(0.0, 0.8);
        // Independent residuals of n rows correlate by ±1/√n; only what exceeds that counts.
        let chance = 1.0 / (residual.len() as f64).sqrt();
        let correlation = (correlation - chance).max(0.0);
        (1.0 + correlation) / (1.0 - correlation)
    }

    /// Number of fitted effect parameters.
    pub fn size(&self) -> usize {
        self.hypothesis.effect_slots()
    }

    /// Covariance of the fitted numbers (posterior), σ² from the residual; `None` where it is singular. A number that sits
    /// where the data do not feel it keeps the width of its bounds, not infinity.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let hypothesis = &self.hypothesis;
        let degrees = (self.fit.samples as f64 - self.size() as f64).max(1.0);
        let sigma = (self.fit.chi2 / degrees + hypothesis.dataset.resolution.powi(2)).sqrt();
        let width = |slot: usize| hypothesis.bounds(slot).1 - hypothesis.bounds(slot).0;
        let mut problem = Weighted { hypothesis, sigma };
        solver::covariance(&mut problem, &self.fit.x, |slot, _| width(slot).powi(-2))
    }
}
