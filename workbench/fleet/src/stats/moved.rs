//! Is a number of a new log where those of the logs before lie?

use super::scatter::p_of_t;
use super::{Point, mean};

/// The logs of a unit scatter by what they tell, and this is known as well as from so many logs. They scatter less where a data sheet
/// contributes the same every day, so that it must not weigh much.
const BELIEF: f64 = 2.0;

/// Two-sided p value of a new reading against earlier ones, of which there is at least one: Student's t for one more of the same, its scatter
/// drawn towards what the logs tell (as in [`super::scatter`]).
pub fn p_value(new: &Point, before: &[Point]) -> f64 {
    let ((middle, total), n) = (mean(before), before.len() as f64);
    let squares: f64 = before.iter().map(|it| it.weight() * (it.value - middle).powi(2)).sum();
    let freedom = BELIEF + n - 1.0;
    let scatter = (BELIEF + squares) / freedom;
    p_of_t((new.value - middle) / (scatter * (new.sigma.powi(2) + 1.0 / total)).sqrt(), freedom)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// The share of alarms at 1 % after so many logs, whose scatter is this part of what they tell.
    fn alarms(logs: usize, scatter: f64) -> f64 {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut point = || {
            let [z, spread]: [f64; 2] = [(); 2].map(|()| StandardNormal.sample(&mut rng));
            let sigma = (0.3 * spread).exp();
            Point { day: 0.0, value: 3.0 + scatter * sigma * z, sigma }
        };
        let series = (0..20_000).map(|_| (0..=logs).map(|_| point()).collect::<Vec<Point>>());
        series.filter(|series| p_value(&series[logs], &series[..logs]) < 0.01).count() as f64 / 20_000.0
    }

    #[test]
    fn false_alarms_are_no_more_than_said_where_logs_scatter_by_what_they_tell_or_less() {
        for logs in [1, 2, 5, 20] {
            assert!(alarms(logs, 1.0) < 0.012, "{logs} logs: {}", alarms(logs, 1.0));
            assert!(alarms(logs, 0.2) < 0.012, "{logs} logs: {}", alarms(logs, 0.2));
        }
        // And of more scatter than is told a unit's own logs tell.
        assert!(alarms(20, 3.0) < 0.02, "{}", alarms(20, 3.0));
    }

    #[test]
    fn a_number_that_moved_is_seen_and_sooner_where_the_logs_scatter_less_than_they_tell() {
        let at = |value: f64| Point { day: 0.0, value, sigma: 1.0 };
        let quiet: Vec<Point> = (0..12).map(|k| at(0.1 * f64::from(k % 3 - 1))).collect();
        assert!(p_value(&at(3.0), &quiet) < 1e-3);
        assert!(p_value(&at(0.1), &quiet) > 0.5);
        // One log before: what both tell.
        assert!(p_value(&at(3.0), &quiet[..1]) > 0.05);
        assert!(p_value(&at(30.0), &quiet[..1]) < 0.01);
    }
}
