//! What protection learns from the starts of a healthy shaft, and what it does not.

use servo::axis::Command;
use servo::commission::Phase;
use servo::protect::{Fault, Settings};
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::faults::calm;
use trials::faults::report::right;
use trials::faults::trial::{Trial, When};
use trials::faults::world::Injury;

/// Least dead zone of the motors here, V: an eighth of the supply, of which nothing is demanded, is less than 1.3 times that.
const LEAST_WIDTH_V: f64 = 1.2;

/// The first geared motor from this number on whose dead zones are wide enough. Its friction at rest is so many times its kinetic
/// friction. Commissioned.
fn commissioned(family: Family, first: u32, ratio: f64) -> (Plant, Trial) {
    let options = Options { tick_hz: 5000, ..Options::default() };
    let mut drawn =
        (first..).map(|seed| Plant::draw(family, Severity::Nominal, Seeds::Design(seed), &options));
    let wide = |plant: &Plant| plant.truth.dead_zone_v.iter().all(|&width| width > LEAST_WIDTH_V);
    let mut plant = drawn.find(wide).expect("there are some");
    plant.motor.friction.breakaway_ratio = ratio;
    plant.sensing.current = false;
    let trial = Trial::commissioned(&plant, &Settings::default(), 5_000);
    assert_eq!(trial.fault(), Fault::None);
    (plant, trial)
}

/// So many dead zones at the terminals, for so many time constants, then none, and the bridge opens: what of friction at
/// rest the observer took for a load is gone then.
fn push(trial: &mut Trial, plant: &Plant, side: usize, dead_zones: f64, time_constants: f64) -> Fault {
    let sign = [1.0, -1.0][side];
    // The loops take the dead zone off.
    let volts = sign * (dead_zones - 1.0) * plant.truth.dead_zone_v[side];
    for (volts, time_constants) in [(volts, time_constants), (0.0, 6.0)] {
        if !trial.may(Command::Voltage(volts as f32)) {
            break;
        }
        trial.run(time_constants * plant.truth.time_constant_s, |_, _| {});
    }
    let fault = trial.fault();
    if fault == Fault::None {
        trial.must(Command::Stop);
        trial.run(2.0 * plant.truth.time_constant_s, |_, _| {});
        trial.must(Command::Arm);
    }
    fault
}

#[test]
fn a_shaft_that_has_often_started_and_then_stalls_below_two_and_a_quarter_dead_zones_is_reported() {
    for (family, seed) in [(Family::G1, 40), (Family::G2, 41), (Family::G3, 42)] {
        let (plant, mut trial) = commissioned(family, seed, 1.05);
        for n in 0..20 {
            assert_eq!(push(&mut trial, &plant, n % 2, 1.35, 5.0), Fault::None, "{family:?} start {n}");
        }
        for side in 0..2 {
            for injury in [Injury::Stall, Injury::EncoderUnplugged] {
                let mut broken = trial.clone();
                broken.world.injure(injury);
                let fault = push(&mut broken, &plant, side, 2.05, 10.0);
                assert_eq!(fault, Fault::NoMotion, "{family:?} {injury:?} {side}");
            }
        }
    }
}

/// The voltage may stand below the break-away level for long, and pass it slowly.
#[test]
fn a_shaft_that_breaks_away_at_two_dead_zones_raises_no_alarm() {
    for (family, seed) in [(Family::G1, 43), (Family::G2, 44), (Family::G3, 45)] {
        let (plant, mut trial) = commissioned(family, seed, 2.0);
        for n in 0..40 {
            let dead_zones = 1.3 + 0.05 * f64::from(n);
            let fault = push(&mut trial, &plant, n as usize % 2, dead_zones, 8.0);
            assert_eq!(fault, Fault::None, "{family:?}, {dead_zones} dead zones");
        }
        let volts = 1.5 * plant.truth.dead_zone_v[0];
        let frequency = 0.03 / plant.truth.time_constant_s;
        let sine = Command::TrackSine {
            amplitude_rad: (volts * plant.truth.gain / (std::f64::consts::TAU * frequency)) as f32,
            frequency_hz: frequency as f32,
            duration_ms: (4e3 / frequency) as u32,
        };
        if trial.may(sine) {
            trial.run(4.0 / frequency, |_, _| {});
        }
        assert_eq!(trial.fault(), Fault::None, "{family:?}, a slow sine");
    }
}

/// What stands still teaches nothing, however often it is asked to start.
#[test]
fn a_stalled_shaft_teaches_nothing() {
    let (plant, mut trial) = commissioned(Family::G2, 41, 1.05);
    for n in 0..10 {
        push(&mut trial, &plant, n % 2, 1.35, 5.0);
    }
    trial.world.injure(Injury::Stall);
    for n in 0..10 {
        assert_eq!(push(&mut trial, &plant, n % 2, 1.4, 8.0), Fault::None, "friction may hold it");
    }
    assert_eq!(push(&mut trial, &plant, 0, 2.05, 10.0), Fault::NoMotion);
}

/// Behind every coasting, at another place of the shaft.
#[test]
fn a_commissioning_starts_the_shaft_twice_more_than_it_must_to_learn() {
    for (family, seed) in [(Family::G1, 50), (Family::G2, 51), (Family::G3, 52)] {
        let plant = Plant::draw(family, Severity::Nominal, Seeds::Design(seed), &Options::default());
        let mut trial = Trial::fresh(&plant, &Settings::default());
        trial.must(Command::Arm);
        trial.must(Command::Commission { budget_ms: 5_000, seed: 1 });
        let (mut starts, mut before) = (0, Phase::Idle as u8);
        trial.run(7.0, |output, _| {
            let phase = output.record.phase;
            starts += usize::from(phase == Phase::BreakAway as u8 && phase != before);
            before = phase;
        });
        assert_eq!(starts, 4, "{family:?}");
        let report = trial.report().commissioning.expect("it has ended");
        assert_eq!(report.refused, None, "{family:?}");
    }
}

/// An axis is armed and told to move at once. It stood with its bridge open, and that counts.
#[test]
fn most_stalls_and_unplugged_encoders_at_rest_are_found_in_time_and_none_has_a_wrong_name() {
    let (mut decidable, mut found, mut stalls, mut named) = (0, 0, 0, 0);
    for family in [Family::G1, Family::G2, Family::G3] {
        for number in 90_000..90_008 {
            let options = Options { tick_hz: 10_000, ..Options::default() };
            let mut plant =
                Plant::draw(family, Severity::Harsh, Seeds::Evaluation(700_000 + number), &options);
            plant.sensing.current = number % 2 == 0;
            let trial = Trial::commissioned(&plant, &Settings::default(), calm::budget_ms(family));
            assert_eq!(trial.fault(), Fault::None, "{family:?} {number} is whole");
            for (k, injury) in [Injury::Stall, Injury::EncoderUnplugged].into_iter().enumerate() {
                let finding = trial.injure(injury, When::AtRest, plant.seed ^ (k as u64) << 8);
                let name = right(injury, finding.sensed).contains(&finding.fault);
                assert!(
                    name || [Fault::NoMotion, Fault::None].contains(&finding.fault),
                    "{family:?} {number} {injury:?}: {finding:?}"
                );
                decidable += usize::from(finding.decidable);
                found += usize::from(finding.decidable && finding.in_limits());
                let stall = finding.sensed && injury == Injury::Stall;
                stalls += usize::from(stall);
                named += usize::from(stall && name);
            }
        }
    }
    // 75 of 98 is the goal, on more plants.
    assert!(4 * found >= 3 * decidable, "{found} of {decidable}");
    assert!(3 * named >= stalls, "{named} of {stalls} stalls have their name");
}
