//! Motors that are wired, described or driven wrongly, reduced; the full suite is `cargo run -p evaluation -- commission-faults`.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::axis::{Axis, Bridge, Command, Sample};
use servo::config::Config;
use servo::identify::estimate::Reason;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::faults::commissioning::{Flaw, Trial, commission};

const BUDGET_S: f64 = 5.0;

fn plant(family: Family, number: u32) -> Plant {
    Plant::draw(family, Severity::Nominal, Seeds::Design(number), &Options::default())
}

/// Either direction first.
fn both_orders(family: Family, flaw: Flaw) -> [Trial; 2] {
    [0, 1].map(|seed| commission(&plant(family, 700 + seed), flaw, BUDGET_S, seed))
}

fn ended_well(trial: &Trial) -> bool {
    trial.report.is_some() && trial.took_s < BUDGET_S + 1.0 && trial.shown.is_soon_over()
}

#[test]
fn a_missing_channel_or_direction_wire_is_told_whichever_direction_comes_first() {
    for family in [Family::G1, Family::G2, Family::G3] {
        for flaw in [Flaw::CountsUp(0.0), Flaw::DirectionWire(1.0, 0.0), Flaw::DirectionWire(-1.0, 0.0)] {
            for trial in both_orders(family, flaw) {
                assert_eq!(trial.reasons(), [Reason::ChannelMissing], "{family:?} {flaw:?}: {trial:?}");
                assert!(ended_well(&trial), "{family:?} {flaw:?}: {trial:?}");
            }
        }
    }
}

#[test]
fn a_direction_that_changes_ends_it_in_every_phase() {
    for at in [0.9, 1.4, 1.9, 2.4, 2.9, 3.4, 3.9, 4.4] {
        for flaw in [Flaw::DriveFlips(at), Flaw::EncoderFlips(at)] {
            let trial = commission(&plant(Family::G2, 710), flaw, BUDGET_S, 1);
            assert_eq!(trial.reasons(), [Reason::DirectionChanged], "{flaw:?}: {trial:?}");
            assert!(ended_well(&trial), "{flaw:?}: {trial:?}");
        }
    }
}

#[test]
fn a_bridge_that_drives_one_way_is_told_whichever_direction_comes_first() {
    for side in [1.0, -1.0] {
        for trial in both_orders(Family::G2, Flaw::Side(side, 0.0)) {
            assert_eq!(trial.reasons(), [Reason::OneDirection], "{side}: {trial:?}");
        }
    }
}

/// What is found contradicts what the axis file says: it is said, and the number that was found with it.
#[test]
fn an_axis_file_that_the_motor_contradicts_is_told_so() {
    let wrong = [(Family::G3, Flaw::Counts(0.25)), (Family::G3, Flaw::Counts(4.0)), (Family::G2, Flaw::Rpm)];
    for (family, flaw) in wrong {
        for trial in both_orders(family, flaw) {
            assert!(trial.reasons().contains(&Reason::SpeedContradicts), "{flaw:?}: {trial:?}");
            let gain = trial.report.expect("it has ended").estimates.gain_rad_s_per_v;
            assert!(!gain.trusted && gain.value.is_some_and(|gain| gain > 0.0), "{flaw:?}: {trial:?}");
        }
    }
    for trial in both_orders(Family::G3, Flaw::Supply(1.45)) {
        assert_eq!(trial.reasons(), [Reason::SupplyNotNominal], "{trial:?}");
    }
}

#[test]
fn a_drive_that_starts_late_or_acts_by_half_is_not_trusted() {
    for trial in both_orders(Family::G3, Flaw::Threshold(0.4)) {
        assert!(trial.reasons().contains(&Reason::StartsHigher), "{trial:?}");
    }
    for trial in both_orders(Family::G2, Flaw::Side(-1.0, 0.5)) {
        assert!(trial.reasons().contains(&Reason::GainsDiffer), "{trial:?}");
        let gain = trial.report.expect("it has ended").estimates.gain_rad_s_per_v;
        assert!(!gain.trusted, "{trial:?}");
    }
}

/// A counter that has nothing to do with the motor: random steps of all sizes, a steady run, or nothing.
#[test]
fn whatever_the_counter_does_it_ends_with_its_budget() {
    let config = Config { tick_hz: 1_000, time_constant_hint_s: Some(0.1).into(), ..Config::EXAMPLE };
    for number in 0..60 {
        let mut rng = ChaCha8Rng::seed_from_u64(number);
        let axis = Axis::new(&Config { gear_ratio: [1.0, 50.0][number as usize % 2], ..config });
        let axis = axis.expect("within the ranges");
        let mut state = axis.start();
        axis.command(&mut state, &Command::Arm).expect("nothing moves");
        axis.command(&mut state, &Command::Commission { budget_ms: 2_000, seed: number as u32 })
            .expect("armed");
        let (mut count, drift, noise) = (0i32, rng.random_range(-20..20), rng.random_range(0..12));
        let ticks = (0..9_000).take_while(|_| {
            let flips = rng.random_bool(0.3);
            count += if flips { drift } else { rng.random_range(-noise..=noise) };
            let output = axis.step(&mut state, Sample { count, ..Sample::NONE });
            axis.report(&state).commissioning.is_none() || output.bridge != Bridge::Open
        });
        let took = ticks.count();
        assert!(took <= 3_000, "{number}: {took} ms, drift {drift}, noise {noise}");
    }
}
