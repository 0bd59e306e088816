//! The suggested next experiment on a few design seeds; the evaluation is a command of its own (docs/naming.md).

use trials::naming::quantile;
use trials::next_experiment::{Found, Trial, examine, report, spec};

#[test]
fn suggested_experiments_tell_rivals_apart_better_than_random_ones() {
    let found: Vec<Found> = (1..=30).map(|seed| examine(&spec(false), seed).unwrap()).collect();
    let separable: Vec<&Trial> = found
        .iter()
        .filter_map(|found| match found {
            Found::Tie(trial) => Some(trial),
            Found::NoTie => None,
        })
        .filter(|trial| trial.separable())
        .collect();
    assert!(separable.len() >= 3, "too few ties to say anything:\n{}", report(&found));
    let ratios: Vec<f64> =
        separable.iter().map(|trial| trial.suggested_chi2 / trial.random_chi2.max(1.0)).collect();
    let resolved = separable.iter().filter(|trial| trial.suggested_resolves).count();
    assert!(quantile(&ratios, 0.5) >= 2.0, "{}", report(&found));
    assert!(2 * resolved >= separable.len(), "{}", report(&found));
}
