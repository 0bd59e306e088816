//! The commissioning at control rates of 1, 10 and 20 kHz on motors of 20 ms to 2.4 s: the sums must neither starve nor
//! overflow, whatever the ratio of time constant to tick.

use servo::optional::Optional;
use trials::commissioning::{Score, commission};
use trials::families::{Cause, Family, Options, Plant, Seeds, Severity, Truth};

/// A plant of family G1 whose inertia makes this time constant.
fn plant(tick_hz: u32, time_constant_s: f64, seed: u32) -> Plant {
    let options = Options { tick_hz, ..Options::default() };
    with_time_constant(time_constant_s, seed, &options)
}

fn with_time_constant(time_constant_s: f64, seed: u32, options: &Options) -> Plant {
    let mut plant = Plant::draw(Family::G1, Severity::Nominal, Seeds::Evaluation(seed), options);
    // The electrical time constant is part of the sum and stays: the inertia carries the rest.
    for _ in 0..4 {
        let ratio = time_constant_s / plant.motor.time_constant();
        plant.motor.inertia *= ratio;
    }
    plant.config.time_constant_hint_s = Optional::NONE;
    plant.truth = Truth::of(&plant.motor);
    plant
}

#[test]
fn commissioning_works_from_20_ms_to_2_4_s_at_1_10_and_20_khz() {
    let mut trusted = 0;
    for (row, tick_hz) in [1_000, 10_000, 20_000].into_iter().enumerate() {
        for (column, time_constant_s) in [0.02, 0.1, 0.5, 2.4].into_iter().enumerate() {
            let seed = 9_500 + 10 * row as u32 + column as u32;
            let plant = plant(tick_hz, time_constant_s, seed);
            assert!((plant.truth.time_constant_s / time_constant_s - 1.0).abs() < 0.01);
            // Five seconds where they suffice, twenty for the slow ones.
            let budget_s = if time_constant_s < 0.3 { 5.0 } else { 20.0 };
            let report = commission(&plant, budget_s, seed, |_, _| {});
            let score = Score::of(&plant, &report);
            let case = format!("{tick_hz} Hz, {time_constant_s} s: {score:?}");
            assert!(score.refused.is_none(), "{case}");
            assert!(score.dead_zone.iter().all(|error| error.abs() < 0.5), "{case}");
            assert!(score.gain.is_some_and(|error| error.abs() < 0.3), "{case}");
            assert!(score.time_constant.is_some_and(|error| error.abs() < 1.0), "{case}");
            trusted += score.trusted.iter().filter(|&&trusted| trusted).count();
        }
    }
    // Twenty seconds are short for 2.4 s: one of its directions may lack speed.
    assert!(trusted >= 22, "{trusted} of 24 directions trusted");
}

/// A shorted coast of a motor of 20 ms lasts some twenty ticks at 1 kHz: too little to be sure, and then it must say so.
#[test]
fn a_coast_of_twenty_ticks_is_not_taken_for_the_other_mechanism() {
    let mut right = 0;
    for number in 0..24 {
        let cause = if number % 2 == 0 { Cause::Friction } else { Cause::Input };
        let options = Options { cause: Some(cause), ..Options::default() };
        let plant = with_time_constant(0.02, 9_600 + number, &options);
        let report = commission(&plant, 5.0, number, |_, _| {});
        let score = Score::of(&plant, &report);
        assert_ne!(score.mechanism, Some(false), "{number}, {cause:?}");
        right += u32::from(score.mechanism == Some(true));
    }
    assert!(right >= 18, "{right} of 24 right");
}
