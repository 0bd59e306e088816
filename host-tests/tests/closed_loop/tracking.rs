//! Reduced tracking suite: the figures of docs/results/README.md, two-sided, on few plants. The full one is the program
//! `tracking` of `evaluation`.

use servo::control::Tuning;
use servo::protect::Fault;
use trials::families::{Family, Seeds, Severity};
use trials::tracking::{Experiment, Knowledge, Run, quantile};

fn runs(family: Family) -> Vec<Run> {
    let experiment = Experiment {
        family,
        severity: Severity::Harsh,
        tick_hz: 1_000,
        speed_share: 0.2,
        frequency_hz: 1.0,
        tuning: Tuning::default(),
        knowledge: Knowledge::Identified(5_000),
    };
    let runs: Vec<Run> =
        (500_000..500_006).filter_map(|n| experiment.run(Seeds::Evaluation(n)).ok()).collect();
    assert!(runs.len() >= 3, "{} of 6 plants trusted their estimates", runs.len());
    runs
}

/// Median factor and median rms (share of the amplitude) within limits on both sides: a figure that is suddenly twice
/// as good is as suspicious as one that is worse.
fn check(family: Family, better: std::ops::Range<f64>, rms: std::ops::Range<f64>) {
    let runs = runs(family);
    let factor = quantile(runs.iter().map(|run| run.rms[0] / run.rms[1]), 0.5);
    let with = quantile(runs.iter().map(|run| run.rms[1]), 0.5);
    assert!(better.contains(&factor), "{factor} times better");
    assert!(rms.contains(&with), "{with} of the amplitude");
    for run in &runs {
        assert_eq!(run.fault, Fault::None);
        assert!(run.rms[0] > run.rms[1], "worse with compensation: {run:?}");
        assert_eq!((run.escapes, run.sign_changes), (0, 0), "hunts: {run:?}");
    }
}

#[test]
fn a_small_fast_motor_tracks_several_times_better_and_rests() {
    check(Family::G1, 4.0..20.0, 0.001..0.009);
}

#[test]
fn a_middle_motor_tracks_many_times_better_and_rests() {
    check(Family::G2, 6.0..35.0, 0.002..0.015);
}

#[test]
fn a_geared_motor_tracks_many_times_better_and_rests() {
    check(Family::G3, 7.0..35.0, 0.003..0.016);
}

/// A dead zone that a short commissioning takes for a few percent too small leaves, in slow motion, more of the voltage than it
/// does: back-EMF is not learned from that, or a current is missed that must not flow.
#[test]
fn a_slow_sine_behind_a_wide_dead_zone_is_no_disconnected_motor() {
    for (number, speed_share) in [(500_005, 0.2), (500_063, 0.05)] {
        let experiment = Experiment {
            family: Family::Paper,
            severity: Severity::Nominal,
            tick_hz: 1_000,
            speed_share,
            frequency_hz: 0.05,
            tuning: Tuning::default(),
            knowledge: Knowledge::Identified(20_000),
        };
        let run = experiment.run(Seeds::Evaluation(number)).expect("trusted");
        assert_eq!(run.fault, Fault::None);
        assert!(run.rms[0] > 10.0 * run.rms[1], "{run:?}");
    }
}
