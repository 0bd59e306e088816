//! Commissioning end to end on drawn plants, reduced; the full suites are `cargo run -p evaluation -- accuracy`.

use rayon::prelude::*;
use servo::optional::Optional;
use trials::commissioning::{Score, commission, quantiles};
use trials::families::{Ceiling, Family, Options, Plant, Seeds, Severity};

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
    let options = Options { tick_hz: 10_000, ..Options::default() };
    for family in [Family::G1, Family::G2, Family::G3] {
        let scores = scores(family, Severity::Nominal, 5.0, 12, &options);
        assert!(scores.iter().all(|score| score.refused.is_none()), "{family:?}: {scores:?}");
        let [_, _, worst] = dead_zone(&scores);
        assert!(worst < 1.0, "{family:?}: dead zone {worst} %");
        let [_, _, worst] = quantiles(scores.iter().flat_map(|score| score.saturation.clone()));
        assert!(worst < 1.0, "{family:?}: saturation {worst} %");
        assert!(scores.iter().all(|score| score.mechanism == Some(true)), "{family:?}: {scores:?}");
    }
}

#[test]
fn papers_motor_needs_more_than_five_seconds() {
    let refused = scores(Family::Paper, Severity::Exact, 5.0, 4, &Options::default());
    assert!(refused.iter().all(|score| score.refused == Some("too_short")), "{refused:?}");
    let given = scores(Family::Paper, Severity::Exact, 12.0, 4, &Options::default());
    let [_, _, worst] = dead_zone(&given);
    assert!(worst < 2.0, "dead zone {worst} %");
}

/// A constant load larger than the friction lets the shaft go one way without a voltage. What the other way needs is no dead zone: compensated as
/// one it would come and go with the sign of the motion, and the axis would follow several times worse.
#[test]
fn a_constant_load_beyond_friction_is_trusted_as_a_dead_zone_of_neither_direction() {
    for number in FIRST..FIRST + 6 {
        let mut plant =
            Plant::draw(Family::G2, Severity::Nominal, Seeds::Evaluation(number), &Options::default());
        let friction = plant.motor.friction.kinetic_nm[0];
        plant.motor.load.constant_nm = if number % 2 == 0 { 1.5 * friction } else { -1.5 * friction };
        let report = commission(&plant, 5.0, number, |_, _| {});
        assert_eq!(report.refused, None, "{number}");
        let found = [report.estimates.dead_zone_pos_v, report.estimates.dead_zone_neg_v];
        assert!(found.iter().all(|zone| !zone.trusted), "{number}: {found:?}");
    }
}

/// A load far beyond friction turns the shaft before a voltage does: whichever way it goes, gain and time constant are found, and a
/// reversed motor under it is refused as without.
#[test]
fn a_shaft_that_its_load_turns_is_commissioned() {
    for (number, share) in (FIRST..FIRST + 12).zip([0.15, -0.15, -0.25, 0.25].into_iter().cycle()) {
        let mut plant =
            Plant::draw(Family::G1, Severity::Nominal, Seeds::Evaluation(number), &Options::default());
        let stall_nm = 12.0 * plant.motor.torque_constant / plant.motor.resistance_ohm;
        plant.motor.friction.kinetic_nm = [0.02 * stall_nm; 2];
        plant.motor.load.constant_nm = share * stall_nm;
        // Every second one begins in the other direction, so all pairs of load and direction occur.
        let report = commission(&plant, 5.0, number / 2, |_, _| {});
        assert_eq!(report.refused, None, "{number}");
        let score = Score::of(&plant, &report);
        assert!(score.gain.is_some_and(|error| error.abs() < 2.0), "{number}: {score:?}");
        assert!(!score.all_trusted(), "{number}: {score:?}");
        plant.motor.torque_constant *= -1.0;
        plant.motor.emf_constant *= -1.0;
        assert!(commission(&plant, 5.0, number / 2, |_, _| {}).refused.is_some(), "{number}, reversed");
    }
}

/// What must be refused, and why.
#[test]
fn refusals_name_their_reason() {
    let plant = || Plant::draw(Family::G2, Severity::Nominal, Seeds::Evaluation(FIRST), &Options::default());
    let refused = |plant: &Plant| commission(plant, 5.0, 0, |_, _| {}).refused.map(|reason| reason.code());
    assert_eq!(refused(&plant()), None);
    let mut stalled = plant();
    stalled.motor.friction.kinetic_nm = [1e3; 2];
    let mut reversed = plant();
    reversed.motor.torque_constant *= -1.0;
    reversed.motor.emf_constant *= -1.0;
    assert_eq!(refused(&reversed), Some("reversed"));
    // With the current sensed, what stands still can be told apart.
    let sensed = |mut plant: Plant, current: bool| {
        plant.sensing.current = current;
        refused(&plant)
    };
    assert_eq!(sensed(stalled.clone(), true), Some("stalled"));
    assert_eq!(sensed(stalled, false), Some("no_motion"));
    let mut unplugged = plant();
    unplugged.sensing.missing = 1.0;
    assert_eq!(sensed(unplugged.clone(), true), Some("encoder_unplugged"));
    assert_eq!(sensed(unplugged, false), Some("no_motion"));
    let mut disconnected = plant();
    disconnected.motor.resistance_ohm *= 1e5;
    assert_eq!(sensed(disconnected, true), Some("motor_disconnected"));
    let mut hot = plant();
    hot.sensing.current = true;
    hot.config.energy_limit_j = Optional::new(0.01);
    assert_eq!(refused(&hot), Some("energy_spent"));
    let mut fast = plant();
    fast.config.speed_limit_rad_s = Optional::new(0.3 * fast.config.rated_speed_rad_s);
    assert_eq!(refused(&fast), Some("overspeed"));
}

/// Five to fifteen counts in a time constant teach nothing, and the reason says so.
#[test]
fn too_coarse_an_encoder_is_named() {
    for number in FIRST..FIRST + 6 {
        let mut plant =
            Plant::draw(Family::G3, Severity::Nominal, Seeds::Evaluation(number), &Options::default());
        plant.config.counts_per_rev = 24;
        let score = Score::of(&plant, &commission(&plant, 5.0, number, |_, _| {}));
        assert_eq!(score.refused.or(score.doubt), Some("encoder_too_slow"), "{number}: {score:?}");
        assert!(!score.all_trusted());
    }
}

/// A load that steps while the motor learns: rarely trusted, and then not far off.
#[test]
fn load_steps_are_noticed() {
    for number in FIRST..FIRST + 12 {
        let plant = Plant::draw(Family::G2, Severity::Harsh, Seeds::Evaluation(number), &Options::default());
        let mean = 0.5 * (plant.truth.dead_zone_v[0] + plant.truth.dead_zone_v[1]);
        let at_s = 1.0 + 0.15 * f64::from(number - FIRST);
        let mut plant = plant.with_load_step(at_s, 0.3);
        plant.truth.dead_zone_v[0] += 0.3 * mean;
        plant.truth.dead_zone_v[1] -= 0.3 * mean;
        let score = Score::of(&plant, &commission(&plant, 5.0, number, |_, _| {}));
        assert!(!score.false_trust(12.0), "{number}, step at {at_s} s: {score:?}");
    }
}

/// Saturation that begins within the range that is learned, and none at all.
#[test]
fn low_knees_are_found_and_none_is_invented() {
    let with = |ceiling| Options { ceiling, ..Options::default() };
    for (share, worst_allowed) in [(0.5, 3.0), (0.56, 3.0), (0.62, 3.0)] {
        let scores = scores(Family::G1, Severity::Nominal, 5.0, 6, &with(Ceiling::At(share)));
        assert!(scores.iter().all(|score| score.unseen == 0), "{share}: {scores:?}");
        let [_, _, worst] = quantiles(scores.iter().flat_map(|score| score.saturation.clone()));
        assert!(worst < worst_allowed, "{share}: saturation {worst} %");
        assert!(!scores.iter().any(|score| score.false_trust(12.0)));
    }
    let scores = scores(Family::G2, Severity::Harsh, 5.0, 12, &with(Ceiling::Absent));
    assert!(scores.iter().all(|score| score.invented == 0), "{scores:?}");
}

/// A joint with end stops: what fits is identified, the stops are not reached.
#[test]
fn limited_travel_is_respected() {
    // In seconds at full speed. Less than one segment needs, and so much that each of them crosses it once.
    let travels = [(Family::G3, 0.3), (Family::G1, 0.4), (Family::G1, 0.6), (Family::G2, 0.8)];
    for ((family, seconds), number) in
        travels.into_iter().flat_map(|it| (FIRST..FIRST + 6).map(move |n| (it, n)))
    {
        let plant = Plant::draw(family, Severity::Nominal, Seeds::Evaluation(number), &Options::default())
            .with_travel(seconds);
        let (mut low, mut high, mut start) = (0, 0, None);
        let report = commission(&plant, 5.0, number, |_, input| {
            let start = *start.get_or_insert(input.count);
            low = low.min(input.count - start);
            high = high.max(input.count - start);
        });
        let [_, travel] = plant.config.travel_limit_rad.unwrap();
        let limit = (travel * plant.config.counts_per_rev as f32 / std::f32::consts::TAU) as i32;
        assert!(-limit <= low && high <= limit, "{number}: {low} … {high} of ± {limit}");
        assert!(report.refused.is_none(), "{number}: {report:?}");
        let score = Score::of(&plant, &report);
        assert!(
            seconds < 0.4 || score.trusted.iter().all(|trusted| *trusted),
            "{family:?} {seconds} s, {number}: {score:?}"
        );
        let [_, _, worst] = dead_zone(std::slice::from_ref(&score));
        assert!(worst < 6.0, "{number}: {score:?}");
    }
}
