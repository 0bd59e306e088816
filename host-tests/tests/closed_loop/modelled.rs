//! What a model tells, in closed loop: the wildest numbers that a servo takes disturb it, and do not make it unstable.

use servo::axis::Command;
use servo::compensate::modelled::{DryFriction, LoadFriction, Modelled, OverSpeed};
use servo::protect::Fault;
use servo::record::Activity;
use std::f64::consts::TAU;
use trials::bench::Bench;
use trials::families::{Cause, Family, Options, Plant, Seeds, Severity};
use trials::tracking::knowing;

const SECONDS: f64 = 4.0;

/// A sine over ± 2 rad, and then at rest: rms of the error in motion, and by how much the counter still moves at the end, rad.
fn followed(bench: &mut Bench, plant: &Plant) -> [f64; 2] {
    let per_rad = f64::from(plant.config.counts_per_rev) / TAU;
    let sine =
        Command::TrackSine { amplitude_rad: 2.0, frequency_hz: 0.5, duration_ms: 1_000 * SECONDS as u32 };
    bench.ask(sine).expect("feasible");
    let (mut squares, mut number) = (0.0, 0.0);
    bench.run(SECONDS, |output, _| {
        let error = f64::from(output.record.reference_q8) / 256.0 - f64::from(output.record.count) - 0.5;
        squares += (error / per_rad).powi(2);
        number += 1.0;
    });
    bench.run(2.0, |_, _| {});
    let (mut low, mut high) = (i32::MAX, i32::MIN);
    bench.run(1.0, |output, _| {
        (low, high) = (low.min(output.record.count), high.max(output.record.count));
    });
    [f64::sqrt(squares / number), f64::from(high - low) / per_rad]
}

/// All that a model can tell, doubted: tick by tick the servo does what it does without.
#[test]
fn what_is_doubted_changes_nothing() {
    let plant = Plant::draw(Family::G3, Severity::Nominal, Seeds::Evaluation(773_000), &Options::default());
    let all = Modelled {
        lag: 300,
        load_friction: 9_000,
        over_speed: OverSpeed { skew: 9_000, drag: 9_000 },
        dry: DryFriction { share: 20_000, breakaway: 4_000, stribeck: 600 },
        play: 20,
        doubted: u8::MAX,
    };
    let [mut plain, mut doubting, mut told] = [(); 3].map(|()| knowing(&plant));
    doubting.ask(Command::Modelled(all)).expect("accepted");
    told.ask(Command::Modelled(Modelled { doubted: 0, ..all })).expect("accepted");
    let without = followed(&mut plain, &plant);
    assert_eq!(followed(&mut doubting, &plant), without);
    assert_ne!(followed(&mut told, &plant), without, "what is not doubted acts");
    assert_eq!(doubting.axis.parameters(&doubting.state).modelled, all);
}

#[test]
fn the_wildest_that_a_model_can_tell_disturbs_and_makes_nothing_unstable() {
    let over = |skew, drag| Modelled { over_speed: OverSpeed { skew, drag }, ..Modelled::default() };
    let dry = |share, breakaway, stribeck| Modelled {
        dry: DryFriction { share, breakaway, stribeck },
        ..Modelled::default()
    };
    let load_friction = LoadFriction::MOST;
    let wild = [
        Modelled { load_friction, ..Modelled::default() },
        over(i16::MAX, u16::MAX),
        over(i16::MIN, 0),
        dry(u16::MAX, 0, 0),
        dry(0, u16::MAX, 600),
        dry(0, u16::MAX, u16::MAX),
        Modelled { lag: 0, load_friction, ..dry(30_000, u16::MAX, 4_000) },
    ];
    for cause in [Cause::Friction, Cause::Input] {
        for number in 0..3 {
            let options = Options { cause: Some(cause), ..Options::default() };
            let plant =
                Plant::draw(Family::G3, Severity::Harsh, Seeds::Evaluation(771_000 + number), &options);
            let bench = knowing(&plant);
            let [right, still] = followed(&mut bench.clone(), &plant);
            let mut plain = bench.clone();
            plain.ask(Command::Compensation(false)).expect("accepted");
            let [without, _] = followed(&mut plain, &plant);
            for told in wild {
                let mut bench = bench.clone();
                bench.ask(Command::Modelled(told)).expect("accepted");
                let [wrong, moves] = followed(&mut bench, &plant);
                assert!(
                    right < 0.2 * without && wrong < 2.0 * without,
                    "{cause:?} {number} {told:?}: {wrong} of {without} rad"
                );
                // It creeps towards its place, and does not swing there.
                assert!(moves < still + 0.06, "{cause:?} {number} {told:?}: {moves} rad at rest");
                assert_eq!(bench.state.fault(), Fault::None, "{told:?}");
            }
        }
    }
}

/// A load that its own friction holds, behind a gear with play: by how much its places differ between moves that come from above and from
/// below, rad. Where an end stop leaves no room to turn, a move goes straight there.
#[test]
fn a_move_ends_on_the_same_flank_of_the_teeth_from_wherever_it_comes() {
    const GAP: f64 = 0.1;
    for cause in [Cause::Friction, Cause::Input] {
        let options = Options { cause: Some(cause), ..Options::default() };
        let plant = Plant::draw(Family::G3, Severity::Nominal, Seeds::Evaluation(772_000), &options);
        let per_rad = f64::from(plant.config.counts_per_rev) / TAU;
        let mut between_stops = plant.clone();
        between_stops.config.travel_limit_rad = Some([-1.05, 3.0]);
        let spread = |plant: &Plant, play: f64, compensation: bool, targets: &[f32]| {
            let mut bench = knowing(plant);
            let told = Modelled { play: (play * per_rad) as u16, ..Modelled::default() };
            bench.ask(Command::Modelled(told)).expect("accepted");
            bench.ask(Command::Compensation(compensation)).expect("accepted");
            let (mut load, mut lowest) = (bench.board.reading().theta, f64::MAX);
            let mut places = Vec::new();
            for target in targets {
                bench.ask(Command::Position(*target)).expect("ready");
                bench.run(6.0, |_, reading| {
                    load = load.clamp(reading.theta - GAP / 2.0, reading.theta + GAP / 2.0);
                    lowest = lowest.min(reading.theta);
                });
                assert_eq!(bench.state.activity(), Activity::Holding);
                places.push(load - f64::from(*target));
            }
            let most = places.iter().copied().fold(f64::MIN, f64::max);
            [most - places.iter().copied().fold(f64::MAX, f64::min), lowest]
        };
        let targets = [1.0, 0.0, 2.0, 1.9, -1.0, 0.5, 0.4];
        let [without, _] = spread(&plant, 0.0, true, &targets);
        let [with, lowest] = spread(&plant, 1.1 * GAP, true, &targets);
        assert!((without - GAP).abs() < 0.02 && with < 0.02, "{cause:?}: {without} rad, {with} rad");
        assert!((lowest + 1.0 + 1.1 * GAP).abs() < 0.02, "{cause:?}: down to {lowest} rad");
        let [off, _] = spread(&plant, 1.1 * GAP, false, &targets);
        assert!(off > 0.8 * GAP, "{cause:?}: {off} rad without compensation");
        let [_, lowest] = spread(&between_stops, 1.1 * GAP, true, &targets);
        assert!((lowest + 1.0).abs() < 0.02, "{cause:?}: down to {lowest} rad between end stops");
    }
}
