//! Commissioning end to end on drawn plants, reduced; the full suites are `cargo run -p host-tests --bin accuracy`.

use host_tests::commissioning::{Score, commission, quantiles};
use host_tests::families::{Family, Options, Plant, Seeds, Severity};
use rayon::prelude::*;

/// Evaluation plants far from those that the documented suites use first.
const FIRST: u32 = 700_000;

fn scores(family: Family, severity: Severity, budget_s: f64, plants: u32, options: &Options) -> Vec<Score> {
    (FIRST..FIRST + plants)
        .into_par_iter()
        .map(|number| {
            let plant = Plant::draw(family, severity, Seeds::Evaluation(number), options);
            Score::of(&plant, &commission(&plant, budget_s, number, |_, _| {}))
        })
        .collect()
}

fn dead_zone(scores: &[Score]) -> [f64; 3] {
    quantiles(scores.iter().flat_map(|score| score.dead_zone.clone()))
}

#[test]
fn main_job_at_10_khz_finds_dead_zone_and_saturation() {
    let options = Options {
        tick_hz: 10_000,
        ..Options::default()
    };
    for family in [Family::G1, Family::G2, Family::G3] {
        let scores = scores(family, Severity::Nominal, 5.0, 12, &options);
        assert!(
            scores.iter().all(|score| score.refused.is_none()),
            "{family:?}: {scores:?}"
        );
        let [_, _, worst] = dead_zone(&scores);
        assert!(worst < 1.0, "{family:?}: dead zone {worst} %");
        let [_, _, worst] = quantiles(scores.iter().flat_map(|score| score.saturation.clone()));
        assert!(worst < 1.0, "{family:?}: saturation {worst} %");
        assert!(
            scores.iter().all(|score| score.mechanism == Some(true)),
            "{family:?}: {scores:?}"
        );
    }
}

#[test]
fn papers_motor_needs_more_than_five_seconds() {
    let refused = scores(Family::Paper, Severity::Exact, 5.0, 4, &Options::default());
    assert!(
        refused.iter().all(|score| score.refused == Some("too_short")),
        "{refused:?}"
    );
    let given = scores(Family::Paper, Severity::Exact, 12.0, 4, &Options::default());
    let [_, _, worst] = dead_zone(&given);
    assert!(worst < 2.0, "dead zone {worst} %");
}
