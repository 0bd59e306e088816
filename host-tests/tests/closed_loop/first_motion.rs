//! The first motion of a joint that nobody knows, reduced: `cargo run -p evaluation -- faults --first-motion`.

use servo::identify::estimate::Reason;
use servo::protect::Fault;
use trials::families::{Cause, Family, Options, Plant, Seeds, Severity};
use trials::faults::first_motion::{FirstMotion, MOST_DEGREES, commission, plant};
use trials::faults::world::Injury;
use trials::tracking::quantile;

/// Harsh plants of the design seeds whose joint holds enough counts, and of which enough is told.
fn bounded(family: Family, sensed: bool) -> impl Iterator<Item = Plant> {
    (400..).map(move |number| plant(family, Seeds::Design(number), 2_000, sensed)).filter(|plant| {
        let counts = plant.config.gear_ratio * plant.config.counts_per_rev as f32 / 72.0;
        plant.config.time_constant_hint_s.get().is_some() && counts > 33.0
    })
}

fn degrees(motions: &[FirstMotion]) -> [f64; 2] {
    [0.5, 1.0].map(|p| quantile(motions.iter().map(|one| one.degrees), p))
}

#[test]
fn a_joint_without_encoder_stays_within_five_degrees() {
    for family in [Family::G1, Family::G2, Family::G3] {
        let motions: Vec<FirstMotion> = bounded(family, false)
            .take(8)
            .map(|plant| commission(&plant, Injury::EncoderUnplugged, 5_000))
            .collect();
        let [median, worst] = degrees(&motions);
        println!("{family:?} unplugged: {median:.2} {worst:.2}");
        assert!(worst <= MOST_DEGREES, "{family:?}: {worst}°");
        assert!(median > 0.2, "{family:?}: shaken in earnest, {median}°");
        let named = |one: &FirstMotion| one.refused == Some(Reason::NoMotion) && one.fault == Fault::None;
        assert!(motions.iter().all(named), "{motions:?}");
    }
}

#[test]
fn a_reversed_encoder_is_refused_after_less_and_a_whole_one_is_not() {
    for family in [Family::G1, Family::G2, Family::G3] {
        for plant in bounded(family, true).take(6) {
            let reversed = commission(&plant, Injury::EncoderReversed, 5_000);
            assert_eq!(reversed.refused, Some(Reason::Reversed), "{family:?}");
            assert!(reversed.degrees < 3.0, "{family:?}: {}°", reversed.degrees);
            let whole = commission(&plant, Injury::None, 5_000);
            assert_eq!((whole.refused, whole.fault), (None, Fault::None), "{family:?}");
            let disconnected = commission(&plant, Injury::MotorDisconnected, 5_000);
            assert_eq!(disconnected.refused, Some(Reason::MotorDisconnected));
        }
    }
}

/// Nothing but rated speed is told, the joint has no gear: the ramp runs, and the current shows the motion.
#[test]
fn where_the_shaft_is_not_shaken_the_current_ends_the_ramp() {
    let unhinted = |sensed: bool| {
        (400..)
            .map(move |number| plant(Family::G3, Seeds::Design(number), 2_000, sensed))
            .filter(|plant| plant.config.time_constant_hint_s.get().is_none())
            .take(8)
    };
    let [sensed, blind] = [true, false].map(|sensed| {
        let motions: Vec<FirstMotion> =
            unhinted(sensed).map(|plant| commission(&plant, Injury::EncoderUnplugged, 5_000)).collect();
        motions
    });
    assert!(sensed.iter().all(|one| one.refused == Some(Reason::EncoderUnplugged)), "{sensed:?}");
    let ([median, worst], [_, unbounded]) = (degrees(&sensed), degrees(&blind));
    println!("sensed: {median:.2} {worst:.2}, blind {unbounded:.1}");
    assert!((2.0..5.0).contains(&median) && worst < 10.0, "{median}°, {worst}°");
    assert!(unbounded > 50.0, "a ramp without current and encoder: {unbounded}°");
    for plant in unhinted(true) {
        let whole = commission(&plant, Injury::None, 5_000);
        assert_eq!((whole.refused, whole.fault), (None, Fault::None));
    }
}

/// Nothing holds a shaft behind an input dead zone: random torque pushes it before any current flows. That drift was once
/// taken for the winding's conductance and for the direction, and these healthy plants were refused as reversed; the last
/// three in the shaking, the others in the ramp.
#[test]
fn a_shaft_that_drifts_behind_an_input_dead_zone_is_no_reversed_motor() {
    let drifting = [
        (Family::G1, 265),
        (Family::G1, 573),
        (Family::G2, 15),
        (Family::G2, 52),
        (Family::G3, 82),
        (Family::G3, 388),
        (Family::G3, 42),
        (Family::G3, 110),
        (Family::G3, 200),
    ];
    let options = Options { cause: Some(Cause::Input), ..Options::default() };
    for (family, number) in drifting {
        let mut plant = Plant::draw(family, Severity::Harsh, Seeds::Design(number), &options);
        plant.sensing.current = true;
        let whole = commission(&plant, Injury::None, 5_000);
        assert_eq!((whole.refused, whole.fault), (None, Fault::None), "{family:?} {number}");
        assert_eq!(whole.shaken, [42, 110, 200].contains(&number), "{family:?} {number}");
        let reversed = commission(&plant, Injury::EncoderReversed, 5_000);
        assert_eq!(reversed.refused, Some(Reason::Reversed), "{family:?} {number}");
    }
}
