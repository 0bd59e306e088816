//! Covariance matrix adaptation: a normal distribution that moves to where costs are low and takes the shape of the valley.
//!
//! Hansen: The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772. Default constants are his.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The distribution, in standard deviations of the search: it begins with mean 0 and covariance 1.
pub(super) struct Adaptation {
    random: ChaCha8Rng,
    weights: Weights,
    mean: DVector<f64>,
    sigma: f64,
    covariance: DMatrix<f64>,
    /// Evolution paths of covariance and step size.
    paths: [DVector<f64>; 2],
    generations: i32,
}

/// What the members of a generation count, the best first.
struct Weights {
    /// Those of the better half add up to 1, those of the worse to −1.
    each: Vec<f64>,
    /// How many members of equal weight the halves are worth.
    effective: [f64; 2],
}

impl Weights {
    fn of(population: usize) -> Self {
        let raw = |place: usize| (0.5 * (population + 1) as f64).ln() - (place as f64).ln();
        let raw: Vec<f64> = (1..=population).map(raw).collect();
        let halves =
            [1.0, -1.0].map(|sign| raw.iter().map(|weight| (sign * weight).max(0.0)).collect::<Vec<_>>());
        let sums = halves.each_ref().map(|half| half.iter().sum::<f64>());
        let squares = halves.each_ref().map(|half| half.iter().map(|weight| weight * weight).sum::<f64>());
        let each = raw.iter().map(|weight| weight / if *weight > 0.0 { sums[0] } else { sums[1] });
        Self { each: each.collect(), effective: [0, 1].map(|half| sums[half] * sums[half] / squares[half]) }
    }
}

impl Adaptation {
    pub fn new(dimensions: usize, population: usize, seed: u64) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(seed),
            weights: Weights::of(population),
            mean: DVector::zeros(dimensions),
            sigma: 1.0,
            covariance: DMatrix::identity(dimensions, dimensions),
            paths: [DVector::zeros(dimensions), DVector::zeros(dimensions)],
            generations: 0,
        }
    }

    /// Draws a generation.
    pub fn generation(&mut self, population: usize) -> Vec<DVector<f64>> {
        let (axes, lengths) = self.axes();
        let mut member = || {
            let along = lengths.map(|length| {
                let z: f64 = StandardNormal.sample(&mut self.random);
                length * z
            });
            &self.mean + self.sigma * (&axes * along)
        };
        (0..population).map(|_| member()).collect()
    }

    /// Principal axes as columns, and the standard deviation along each.
    fn axes(&self) -> (DMatrix<f64>, DVector<f64>) {
        let eigen = self.covariance.clone().symmetric_eigen();
        (eigen.eigenvectors, eigen.eigenvalues.map(|value| value.max(f64::MIN_POSITIVE).sqrt()))
    }

    /// Takes the members of the last generation, the best first.
    pub fn learn(&mut self, ranked: &[&DVector<f64>]) {
        let n = self.mean.len() as f64;
        let Weights { each, effective: [effective, worst_effective] } = &self.weights;
        let c_sigma = (effective + 2.0) / (n + effective + 5.0);
        let c_c = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let c_1 = 2.0 / ((n + 1.3).powi(2) + effective);
        let c_mu = (2.0 * (0.25 + effective + 1.0 / effective - 2.0) / ((n + 2.0).powi(2) + effective))
            .min(1.0 - c_1);
        let damping = 1.0 + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma;
        // The expected length of a vector of n standard normal numbers.
        let length = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
        let most_negative = (1.0 + c_1 / c_mu)
            .min(1.0 + 2.0 * worst_effective / (effective + 2.0))
            .min((1.0 - c_1 - c_mu) / (n * c_mu));

        let (axes, lengths) = self.axes();
        let whitened = |step: &DVector<f64>| &axes * (axes.transpose() * step).component_div(&lengths);
        let steps: Vec<DVector<f64>> =
            ranked.iter().map(|member| (*member - &self.mean) / self.sigma).collect();
        let step: DVector<f64> = each.iter().zip(&steps).map(|(weight, step)| step * weight.max(0.0)).sum();

        self.generations += 1;
        let [path_c, path_sigma] = &mut self.paths;
        *path_sigma =
            &*path_sigma * (1.0 - c_sigma) + whitened(&step) * (c_sigma * (2.0 - c_sigma) * effective).sqrt();
        let settled = (1.0 - (1.0 - c_sigma).powi(2 * self.generations)).sqrt();
        let moves = path_sigma.norm() / settled < (1.4 + 2.0 / (n + 1.0)) * length;
        let gain = if moves { (c_c * (2.0 - c_c) * effective).sqrt() } else { 0.0 };
        *path_c = &*path_c * (1.0 - c_c) + &step * gain;
        let lost = if moves { 0.0 } else { c_1 * c_c * (2.0 - c_c) };
        let all = 1.0 - most_negative;
        let mut covariance = &self.covariance * (1.0 + lost - c_1 - c_mu * all);
        covariance.ger(c_1, path_c, path_c, 1.0);
        for (weight, step) in each.iter().zip(&steps) {
            let weight = match *weight >= 0.0 {
                true => *weight,
                // A step in a bad direction takes away, however long it was, what one of usual length would.
                false => weight * most_negative * n / whitened(step).norm_squared().max(f64::MIN_POSITIVE),
            };
            covariance.ger(c_mu * weight, step, step, 1.0);
        }
        self.covariance = covariance;
        self.mean += step * self.sigma;
        self.sigma *= (c_sigma / damping * (path_sigma.norm() / length - 1.0)).exp();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley is bent and narrow; its least value lies at (1, 1, 1).
    #[test]
    fn the_end_of_a_bent_valley_is_found() {
        let cost = |x: &DVector<f64>| -> f64 {
            x.as_slice().windows(2).map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2)).sum()
        };
        let mut adaptation = Adaptation::new(3, 14, 0);
        for _ in 0..200 {
            let mut members = adaptation.generation(14);
            members.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
            adaptation.learn(&members.iter().collect::<Vec<_>>());
        }
        assert!(adaptation.mean.iter().all(|x| (x - 1.0).abs() < 1e-3), "{}", adaptation.mean);
    }
}
