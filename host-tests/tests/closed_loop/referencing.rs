//! Referencing in closed loop, on motors with friction, ripple and a stop: by the stop, by the index, and by hand.

use servo::axis::Command;
use servo::axis::{Bridge, Refusal};
use servo::config::Config;
use servo::identify::estimate::Estimates;
use servo::motion::referencing::Referencing;
use servo::protect::Fault;
use servo::record::Referenced;
use servo::record::{Activity, Limit};
use std::f64::consts::TAU;
use trials::bench::Bench;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::stops::{STOP_TURNS, between_stops};
use trials::tracking::exact;

fn bench(plant: &Plant, estimates: Option<Estimates>) -> Bench {
    let mut bench = Bench::new(plant);
    bench.run(0.01, |_, _| {});
    if let Some(estimates) = estimates {
        bench.axis.adopt(&mut bench.state, &estimates).expect("idle");
    }
    order(&mut bench, Command::Arm).expect("no fault");
    bench
}

fn order(bench: &mut Bench, command: Command) -> Result<(), Refusal> {
    bench.axis.command(&mut bench.state, &command)
}

/// Runs until the search is over: its result and the seconds that it took.
fn search(bench: &mut Bench, seconds: f64, index: impl Fn(i32) -> bool) -> (Referenced, f64) {
    let ticks = (seconds * 10_000.0) as u32;
    for tick in 0..ticks {
        let sample = bench.board.sample();
        if index(sample.count) {
            bench.axis.index(&mut bench.state);
        }
        let output = bench.axis.step(&mut bench.state, sample);
        bench.board.pass(output.bridge, output.duty);
        if tick > 0 && output.record.referenced != Referenced::Searching {
            return (output.record.referenced, f64::from(tick) / 10_000.0);
        }
    }
    (Referenced::Searching, seconds)
}

fn slow(plant: &Plant) -> f32 {
    (0.08 * plant.truth.gain * 12.0) as f32
}

fn stop(plant: &Plant, direction: f32, current_a: Option<f32>) -> Command {
    Command::Reference(Referencing::EndStop {
        speed_rad_s: direction * slow(plant),
        position_rad: -1.0,
        reach_rad: (4.0 * STOP_TURNS * TAU) as f32,
        current_a,
    })
}

fn counts(plant: &Plant, rad: f64) -> f64 {
    rad / TAU * f64::from(plant.config.counts_per_rev)
}

#[test]
fn an_end_stop_is_found_in_both_directions_and_makes_positions_absolute() {
    for (family, seed, direction) in
        [(Family::G1, 11, 1.0), (Family::G1, 12, -1.0), (Family::G2, 13, -1.0), (Family::G3, 14, 1.0)]
    {
        let plant = between_stops(family, seed);
        let mut bench = bench(&plant, Some(exact(&plant)));
        assert_eq!(order(&mut bench, Command::GoTo(0.0)), Err(Refusal::NotReferenced));
        order(&mut bench, stop(&plant, direction, None)).expect("a slow search");
        let (result, seconds) = search(&mut bench, 30.0, |_| false);
        let found = bench.board.reading().theta / TAU;
        assert_eq!(result, Referenced::Yes, "{family:?} after {seconds} s at {found} turns");
        let there = f64::from(direction) * STOP_TURNS;
        let off = counts(&plant, (found - there).abs() * TAU);
        assert!(off < 4.0, "{family:?}: {off} counts from the stop");

        // The stop is called −1 rad; absolute targets count from there.
        let inside = -1.0 - direction;
        order(&mut bench, Command::GoTo(inside)).expect("referenced");
        bench.run(8.0, |_, _| {});
        let turned = (bench.board.reading().theta - there * TAU) + f64::from(direction);
        assert!(
            counts(&plant, turned).abs() < 6.0,
            "{family:?}: {} counts off an absolute target",
            counts(&plant, turned)
        );
        assert_eq!(bench.state.fault(), Fault::None);
    }
}

/// It leans on the stop: a small part of the stall torque, and no longer than it takes to be sure.
#[test]
fn the_stop_is_leaned_on_and_let_go() {
    let plant = between_stops(Family::G1, 21);
    let mut bench = bench(&plant, Some(exact(&plant)));
    order(&mut bench, stop(&plant, 1.0, None)).expect("a slow search");
    let stall = plant.motor.drive.supply_v / plant.motor.resistance_ohm;
    let (mut greatest, mut pushed) = (0.0f64, 0u32);
    bench.run(15.0, |output, reading| {
        greatest = greatest.max(reading.current.abs() / stall);
        pushed += u32::from(output.record.limit == Limit::Push);
    });
    assert!(pushed > 0, "the bound has acted");
    // Dead zone 10 %, steady voltage twice 8 %, and 6 %.
    assert!(greatest < 0.45, "{greatest} of the stall current");
    assert_eq!(bench.state.activity(), Activity::Holding);
    let mut resting = 0.0f64;
    bench.run(1.0, |_, reading| resting = resting.max(reading.current.abs() / stall));
    assert!(resting < 0.2, "{resting} of the stall current while holding");
}

/// With the current sensed and the compensation of no use, a held shaft is seen by its current.
#[test]
fn the_current_alone_tells_a_held_shaft() {
    let mut plant = between_stops(Family::G1, 22);
    plant.sensing.current = true;
    let stall = plant.motor.drive.supply_v / plant.motor.resistance_ohm;
    let mut bench = bench(&plant, Some(exact(&plant)));
    order(&mut bench, stop(&plant, 1.0, Some(0.12 * stall as f32))).expect("a slow search");
    let (result, _) = search(&mut bench, 30.0, |_| false);
    let off = counts(&plant, (bench.board.reading().theta / TAU - STOP_TURNS).abs() * TAU);
    assert_eq!(result, Referenced::Yes);
    assert!(off < 4.0, "{off} counts from the stop");
}

/// A shaft that never moved proves nothing: it may be at the stop, or the encoder may be unplugged.
#[test]
fn a_shaft_that_never_moves_is_no_end_stop() {
    let plant = between_stops(Family::G1, 23);
    let mut bench = bench(&plant, Some(exact(&plant)));
    let frozen = bench.board.sample().count;
    order(&mut bench, stop(&plant, 1.0, None)).expect("a slow search");
    let mut last = Referenced::Searching;
    for _ in 0..100_000 {
        let sample = servo::axis::Sample { count: frozen, ..bench.board.sample() };
        let output = bench.axis.step(&mut bench.state, sample);
        bench.board.pass(output.bridge, output.duty);
        last = output.record.referenced;
        if output.bridge == Bridge::Open {
            break;
        }
    }
    assert_ne!(last, Referenced::Yes);
    assert_eq!(order(&mut bench, Command::GoTo(0.0)), Err(Refusal::NotReferenced));
}

#[test]
fn a_search_without_a_stop_ends_after_its_reach() {
    let options = Options { tick_hz: 10_000, ..Options::default() };
    let plant = Plant::draw(Family::G1, Severity::Nominal, Seeds::Design(24), &options);
    let mut bench = bench(&plant, Some(exact(&plant)));
    order(&mut bench, stop(&plant, 1.0, None)).expect("a slow search");
    let (result, _) = search(&mut bench, 60.0, |_| false);
    assert_eq!(result, Referenced::Missed);
    let turns = bench.board.reading().theta / TAU;
    assert!((turns - 4.0 * STOP_TURNS).abs() < 0.5, "{turns} turns");
    bench.run(2.0, |_, _| {});
    assert_eq!(bench.state.activity(), Activity::Holding);
}

/// The index is one count wide, somewhere in the turn, and is found to the count.
#[test]
fn the_index_is_found_to_the_count() {
    for direction in [1.0f32, -1.0] {
        let plant = between_stops(Family::G1, 25);
        let per_turn = plant.config.counts_per_rev as i32;
        let at = per_turn / 3;
        let mut bench = bench(&plant, Some(exact(&plant)));
        let per_tick = 10_000.0 * TAU as f32 / plant.config.counts_per_rev as f32;
        let too_fast = Referencing::Index { speed_rad_s: 1.5 * per_tick, position_rad: 0.0, reach_rad: 7.0 };
        assert_eq!(order(&mut bench, Command::Reference(too_fast)), Err(Refusal::OutOfRange));
        let search_index = Referencing::Index {
            speed_rad_s: direction * slow(&plant).min(0.5 * per_tick),
            position_rad: 0.5,
            reach_rad: 7.0,
        };
        order(&mut bench, Command::Reference(search_index)).expect("a slow search");
        let (result, _) = search(&mut bench, 20.0, |count| count.rem_euclid(per_turn) == at);
        assert_eq!(result, Referenced::Yes);
        order(&mut bench, Command::GoTo(0.5)).expect("referenced");
        bench.run(4.0, |_, _| {});
        let count = bench.board.sample().count.rem_euclid(per_turn);
        assert!((count - at).abs() <= 1, "{count} instead of {at}");
    }
}

#[test]
fn here_is_x_moves_the_travel_limits_along() {
    let plant = between_stops(Family::G1, 26);
    let config = Config { travel_limit_rad: Some([-1.0, 1.0]), gear_ratio: 1.0, ..plant.config };
    let mut bench = bench(&Plant { config, ..plant.clone() }, Some(exact(&plant)));
    // Unreferenced: limits count from power-up, absolute targets are refused.
    assert_eq!(order(&mut bench, Command::GoTo(0.5)), Err(Refusal::NotReferenced));
    assert_eq!(order(&mut bench, Command::Position(1.2)), Err(Refusal::BeyondTravel));
    order(&mut bench, Command::Reference(Referencing::Here { position_rad: 0.8 })).expect("at rest");
    assert_eq!(order(&mut bench, Command::GoTo(1.2)), Err(Refusal::BeyondTravel));
    // 0.5 rad onward from power-up is 1.3 rad now.
    assert_eq!(order(&mut bench, Command::Position(0.5)), Err(Refusal::BeyondTravel));
    order(&mut bench, Command::GoTo(-0.5)).expect("within the travel");
    let moving = Referencing::Here { position_rad: 0.0 };
    bench.run(0.02, |_, _| {});
    assert_eq!(order(&mut bench, Command::Reference(moving)), Err(Refusal::Busy));
    bench.run(5.0, |_, _| {});
    let turned = bench.board.reading().theta;
    let off = counts(&plant, turned + 1.3).abs();
    assert!(off < 2.5, "{turned} rad from power-up, {off} counts off");
}
