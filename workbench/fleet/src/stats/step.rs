//! A step at an unknown day: the largest of all statistics of a split (D. V. Hinkley, Biometrika 57, 1970).
//!
//! The largest of many correlated statistics has no table of its own for unequal weights, so its distribution without a step is
//! simulated, with the weights of the series and the scatter of the fleet. The seed is fixed: the same series has the same p value. Far out
//! the splits seldom exceed together: there the sum of their own p values (Bonferroni) is close, and never too small.

use super::Point;
use super::scatter::{Common, p_of_t};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

/// Logs on either side of a step at least: one log alone may be an accident.
pub const SIDE: usize = 2;
/// Series that are drawn at once.
const ROUND: usize = 1_000;
/// Below this bound it is taken itself: within a factor of three, where the largest fleets still need a p value.
const FAR: f64 = 3e-4;
/// WithoutStep series that exceed the statistic, from which on a p value is known to a fifth of itself.
const ENOUGH: usize = 25;
/// Any fixed number.
const SEED: u64 = 0x5745_5053;

/// The best step of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The first log after it.
    pub first: usize,
    /// Weighted means before and after.
    pub levels: [f64; 2],
    /// Inverse of the variance of their difference, in units of the scatter.
    pub information: f64,
    /// Squared difference over its variance.
    pub statistic: f64,
    /// Weighted squares that are left.
    pub left: f64,
}

impl Step {
    /// The split of a series of at least four logs that leaves least.
    pub fn of(points: &[Point]) -> Self {
        let weights: Vec<f64> = points.iter().map(Point::weight).collect();
        let values: Vec<f64> = points.iter().map(|it| it.value).collect();
        Self::split(&weights, &values)
    }

    fn split(weights: &[f64], values: &[f64]) -> Self {
        let sum =
            |of: &dyn Fn(f64, f64) -> f64| weights.iter().zip(values).map(|(w, y)| of(*w, *y)).sum::<f64>();
        let total = sum(&|w, _| w);
        let centre = sum(&|w, y| w * y) / total;
        let all = sum(&|w, y| w * (y - centre).powi(2));
        let mut best = Self { first: 0, levels: [centre; 2], information: 0.0, statistic: -1.0, left: all };
        let (mut before, mut off) = (0.0, 0.0);
        for first in 1..=weights.len() - SIDE {
            before += weights[first - 1];
            off += weights[first - 1] * (values[first - 1] - centre);
            let after = total - before;
            // Both means lie about the centre: off/before before, −off/after behind.
            let statistic = off * off * total / (before * after);
            if first >= SIDE && statistic > best.statistic {
                let levels = [centre + off / before, centre - off / after];
                let information = before * after / total;
                best = Self { first, levels, information, statistic, left: (all - statistic).max(0.0) };
            }
        }
        best
    }

    /// The statistic in units of a scatter drawn towards that of the fleet.
    fn studentised(&self, logs: usize, common: Common) -> f64 {
        let freedom = logs as f64 - 2.0;
        self.statistic / common.moderated(self.left / freedom, freedom).0
    }
}

/// The p value of the best step of a series.
pub fn p_value(points: &[Point], step: &Step, common: Common) -> f64 {
    let weights: Vec<f64> = points.iter().map(Point::weight).collect();
    let found = step.studentised(points.len(), common);
    let mut drawn = WithoutStep { rng: ChaCha8Rng::seed_from_u64(SEED), weights: &weights, common };
    let (splits, freedom) = (weights.len() + 1 - 2 * SIDE, common.freedom + weights.len() as f64 - 2.0);
    let bound = splits as f64 * p_of_t(found.sqrt(), freedom);
    if bound < FAR {
        return bound;
    }
    let (mut larger, mut done) = (0, 0);
    while larger < ENOUGH {
        larger += (0..ROUND).filter(|_| drawn.statistic() >= found).count();
        done += ROUND;
    }
    (larger + 1) as f64 / (done + 1) as f64
}

/// Series without a step. Where the bound is not small, one in some thousands exceeds: drawing comes to an end.
struct WithoutStep<'a> {
    rng: ChaCha8Rng,
    weights: &'a [f64],
    common: Common,
}

impl WithoutStep<'_> {
    fn statistic(&mut self) -> f64 {
        let scatter = self.scatter().sqrt();
        let value =
            |w: &f64| scatter * Distribution::<f64>::sample(&StandardNormal, &mut self.rng) / w.sqrt();
        let values: Vec<f64> = self.weights.iter().map(value).collect();
        Step::split(self.weights, &values).studentised(self.weights.len(), self.common)
    }

    /// The scatter of one unit of the fleet: s₀² d₀/χ².
    fn scatter(&mut self) -> f64 {
        let Common { variance, freedom } = self.common;
        match ChiSquared::new(freedom) {
            Ok(chi) if freedom < 1e6 => variance * freedom / chi.sample(&mut self.rng),
            _ => variance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(drawn: &mut WithoutStep, step: f64) -> Vec<Point> {
        let point = |(k, w): (usize, f64)| {
            let z: f64 = StandardNormal.sample(&mut drawn.rng);
            let sigma = w.powf(-0.5);
            Point { day: k as f64, value: sigma * z + if k < 8 { 0.0 } else { step }, sigma }
        };
        drawn.weights.iter().copied().enumerate().map(point).collect()
    }

    #[test]
    fn p_values_without_a_step_are_uniform_and_a_step_is_placed() {
        let common = Common { variance: 1.0, freedom: f64::INFINITY };
        let weights: Vec<f64> = (0..20).map(|k| 1.0 + f64::from(k % 3)).collect();
        let mut drawn = WithoutStep { rng: ChaCha8Rng::seed_from_u64(7), weights: &weights, common };
        let quiet: Vec<Vec<Point>> = (0..1000).map(|_| series(&mut drawn, 0.0)).collect();
        let p: Vec<f64> = quiet.iter().map(|it| p_value(it, &Step::of(it), common)).collect();
        for level in [0.05, 0.2, 0.5, 0.8] {
            let below = p.iter().filter(|p| **p <= level).count() as f64 / 1000.0;
            // Three standard deviations of the difference of two shares of a thousand: all series meet the same draws.
            assert!((below - level).abs() < 0.067, "{below} at {level}");
        }
        let moved = series(&mut drawn, 8.0);
        let step = Step::of(&moved);
        assert_eq!(step.first, 8);
        assert!(p_value(&moved, &step, common) < 1e-20);
    }

    #[test]
    fn the_statistic_of_a_split_is_what_it_takes_away_from_the_squares() {
        let common = Common { variance: 1.0, freedom: 0.0 };
        let weights = [1.0, 4.0, 2.0, 1.0, 3.0, 1.0, 0.5, 2.0];
        let mut drawn = WithoutStep { rng: ChaCha8Rng::seed_from_u64(1), weights: &weights, common };
        let points = series(&mut drawn, 0.0);
        let step = Step::of(&points);
        let left: f64 = [&points[..step.first], &points[step.first..]]
            .into_iter()
            .zip(step.levels)
            .flat_map(|(side, level)| side.iter().map(move |it| it.weight() * (it.value - level).powi(2)))
            .sum();
        assert!((left - step.left).abs() < 1e-9, "{left} {step:?}");
    }
}
