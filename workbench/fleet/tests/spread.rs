//! The spread between units against other programs: `reference/random_effects.py`.

use clap::ValueEnum;
use serde::Deserialize;
use truing_fleet::stats::spread::{Method, Unit, spread};

#[derive(Deserialize)]
struct Case {
    y: Vec<f64>,
    v: Vec<f64>,
    between_interval: [f64; 2],
    fits: Vec<Fit>,
}

#[derive(Deserialize)]
struct Fit {
    method: String,
    mean: f64,
    mean_interval: [f64; 2],
    between: f64,
}

fn close(found: f64, wanted: f64, scale: f64) -> bool {
    (found - wanted).abs() <= 1e-6 * scale
}

#[test]
fn a_random_effects_fit_is_that_of_statsmodels_and_scipy_to_a_millionth() {
    let cases: Vec<Case> = serde_json::from_str(include_str!("reference/random_effects.json")).unwrap();
    assert!(cases.len() >= 5);
    for case in &cases {
        let units: Vec<Unit> = case.y.iter().copied().zip(case.v.iter().copied()).collect();
        // A spread of 0 has no relative error: the smallest standard deviation of a unit is the measure then.
        let least = case.v.iter().copied().fold(f64::INFINITY, f64::min).sqrt();
        for fit in &case.fits {
            let found = spread(&units, Method::from_str(&fit.method, false).unwrap()).unwrap();
            let told = format!("{}, {} units: {found:?}", fit.method, units.len());
            assert!(close(found.between, fit.between, fit.between.max(least)), "{told}, {}", fit.between);
            assert!(close(found.mean, fit.mean, fit.mean.abs()), "{told}, {}", fit.mean);
            for k in 0..2 {
                assert!(close(found.mean_interval[k], fit.mean_interval[k], fit.mean.abs()), "{told}");
                let wanted = case.between_interval[k];
                assert!(close(found.between_interval[k], wanted, wanted.max(least)), "{told}, {wanted}");
            }
        }
    }
}

#[test]
fn one_unit_has_no_spread() {
    assert_eq!(spread(&[(1.0, 0.1)], Method::Reml), None);
}
