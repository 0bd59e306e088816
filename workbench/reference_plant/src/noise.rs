//! Random sequences with a seed.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A first-order Gauss–Markov sequence: sampled Ornstein–Uhlenbeck noise, or an AR(1) colouring of sensor noise.
#[derive(Clone, Debug)]
pub struct GaussMarkov {
    rms: f64,
    memory: f64,
    value: f64,
    rng: ChaCha8Rng,
}

impl GaussMarkov {
    /// AR(1) with this rms and coefficient, stationary from the start.
    pub fn new(rms: f64, memory: f64, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let first: f64 = StandardNormal.sample(&mut rng);
        Self { rms, memory, value: rms * first, rng }
    }

    /// Ornstein–Uhlenbeck noise of correlation time `correlation_s`, sampled every `interval_s`.
    pub fn sampled(rms: f64, correlation_s: f64, interval_s: f64, seed: u64) -> Self {
        Self::new(rms, (-interval_s / correlation_s).exp(), seed)
    }

    /// The next value.
    pub fn next_value(&mut self) -> f64 {
        if self.rms == 0.0 {
            return 0.0;
        }
        let fresh: f64 = StandardNormal.sample(&mut self.rng);
        self.value = self.memory * self.value + self.rms * (1.0 - self.memory * self.memory).sqrt() * fresh;
        self.value
    }
}
