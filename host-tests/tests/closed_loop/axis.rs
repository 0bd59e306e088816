//! One joint as a whole: what it accepts, what it refuses, and that it is a value that repeats itself bit by bit.

use servo::axis::Command;
use servo::axis::{Axis, Bridge, Output, Refusal, Sample};
use servo::config::Config;
use servo::identify::estimate::Reason;
use servo::optional::Optional;
use servo::record::{Activity, Source};
use std::f64::consts::TAU;
use trials::bench::Bench;
use trials::families::{Plant, Sensing, Truth};
use truing::synthetic::reference_plant::{Friction, Motor};

/// A small geared motor: 12 V, 20 rad/s/V, 40 ms, 1.2 V of friction, 500 counts.
fn plant() -> Plant {
    let (resistance, constant) = (1.5, 0.05);
    let mut motor = Motor::linear(resistance, 1e-3, constant, 6.7e-5, 1e-6, 12.0);
    motor.friction = Friction::coulomb(1.2 * constant / resistance);
    let config = Config {
        supply_nominal_v: 12.0,
        counts_per_rev: 500,
        rated_speed_rad_s: 220.0,
        tick_hz: 10_000,
        gear_ratio: 1.0,
        pwm_delay_ticks: 1,
        pwm_full_scale: 4200,
        vbus_v_per_lsb: 0.005,
        current_a_per_lsb: 0.01,
        ..Config::EXAMPLE
    };
    let sensing = Sensing {
        phase_error: 0.1,
        missing: 0.0,
        vbus: true,
        vbus_noise: 0.002,
        vbus_delay: 0,
        current: false,
        current_noise: 0.0,
    };
    Plant { seed: 7, truth: Truth::of(&motor), motor, config, sensing }
}

/// Runs for a time, s, and gives the last output.
fn run(bench: &mut Bench, seconds: f64) -> Output {
    let mut last = Output::default();
    bench.run(seconds, |output, _| last = *output);
    last
}

fn must(bench: &mut Bench, command: Command) {
    bench
        .axis
        .command(&mut bench.state, &command)
        .unwrap_or_else(|refusal| panic!("{command:?}: {refusal:?}"));
}

fn refused(bench: &mut Bench, command: Command) -> Refusal {
    bench.axis.command(&mut bench.state, &command).expect_err("a refusal")
}

const SINE: Command = Command::TrackSine { amplitude_rad: 6.0, frequency_hz: 1.0, duration_ms: 3_000 };
const COMMISSION: Command = Command::Commission { budget_ms: 5_000, seed: 1 };

#[test]
fn it_commissions_itself_and_then_tracks_several_times_better_with_what_it_learned() {
    let mut bench = Bench::new(&plant());
    run(&mut bench, 0.01);
    must(&mut bench, Command::Arm);
    must(&mut bench, COMMISSION);
    let idle = run(&mut bench, 6.0);
    let report = bench.axis.report(&bench.state).commissioning.expect("an outcome");
    assert_eq!(report.refused, None);
    let (positive, negative) = (report.estimates.dead_zone_pos_v, report.estimates.dead_zone_neg_v);
    assert!(positive.trusted && negative.trusted, "{report:?}");
    assert!((positive.value.expect("a value") - 1.2).abs() < 0.03, "{positive:?}");
    assert_eq!(idle.bridge, Bridge::Open);

    let counts_per_rad = 500.0 / TAU;
    let rms = [false, true].map(|on| {
        must(&mut bench, Command::Compensation(on));
        must(&mut bench, SINE);
        let mut squares = 0.0;
        let mut theta = bench.board.reading().theta;
        bench.run(3.0, |output, reading| {
            let reference = f64::from(output.record.reference_q8) / 256.0 / counts_per_rad;
            squares += (reference - theta).powi(2);
            theta = reading.theta;
        });
        (squares / 30_000.0).sqrt() / 6.0
    });
    assert!(rms[1] < 0.013, "{rms:?} of the amplitude");
    assert!(rms[0] > 4.0 * rms[1], "{rms:?} of the amplitude");
    let record = run(&mut bench, 0.01).record;
    assert_eq!(record.gain_source, Source::Trusted);
    assert_eq!(record.dead_zone_source, [Source::Trusted; 2]);
}

#[test]
fn torque_needs_arming_and_motion_needs_knowledge() {
    let mut bench = Bench::new(&plant());
    run(&mut bench, 0.01);
    assert_eq!(refused(&mut bench, SINE), Refusal::NotArmed);
    assert_eq!(refused(&mut bench, COMMISSION), Refusal::NotArmed);
    must(&mut bench, Command::Arm);
    assert_eq!(refused(&mut bench, SINE), Refusal::NotIdentified);
    assert_eq!(refused(&mut bench, Command::Position(1.0)), Refusal::NotIdentified);
    must(&mut bench, COMMISSION);
    assert_eq!(refused(&mut bench, COMMISSION), Refusal::Busy);
    assert_eq!(refused(&mut bench, SINE), Refusal::Busy);
    assert_eq!(run(&mut bench, 0.5).record.activity, Activity::Commissioning);
    must(&mut bench, Command::Stop);
    let output = run(&mut bench, 0.01);
    assert_eq!((output.bridge, output.duty), (Bridge::Open, 0));
    let report = bench.axis.report(&bench.state).commissioning.expect("an outcome");
    assert_eq!(report.refused, Some(Reason::Aborted));
    assert_eq!(refused(&mut bench, SINE), Refusal::NotArmed);
}

#[test]
fn targets_beyond_the_end_stops_are_refused() {
    let mut plant = plant();
    plant.config.travel_limit_rad = Some([-3.0, 3.0]);
    plant.config.time_constant_hint_s = Optional::new(0.04);
    let mut bench = Bench::new(&plant);
    run(&mut bench, 0.01);
    must(&mut bench, Command::Arm);
    assert_eq!(refused(&mut bench, SINE), Refusal::BeyondTravel);
    assert_eq!(refused(&mut bench, Command::Position(3.1)), Refusal::BeyondTravel);
    assert_eq!(refused(&mut bench, Command::Position(f32::NAN)), Refusal::OutOfRange);
    must(&mut bench, Command::Position(2.9));
}

#[test]
fn a_replay_of_the_raw_integers_gives_the_same_bits_and_two_axes_do_not_disturb_one_another() {
    let mut bench = Bench::new(&plant());
    let axis = Axis::new(&plant().config).expect("valid configuration");
    let (mut replay, mut bystander) = (axis.start(), axis.start());
    for k in 0..60_000u32 {
        if let Some(command) = match k {
            100 => Some(Command::Arm),
            101 => Some(COMMISSION),
            55_000 => Some(SINE),
            _ => None,
        } {
            must(&mut bench, command);
            axis.command(&mut replay, &command).expect("accepted as on the chip");
        }
        let output = bench.tick();
        let record = output.record;
        let sample =
            Sample { count: record.count, vbus_raw: record.vbus_raw, current_raw: record.current_raw };
        assert_eq!(axis.step(&mut replay, sample), output, "tick {k}");
        let idle = axis.step(&mut bystander, Sample { count: -record.count, ..sample });
        assert_eq!((idle.bridge, idle.duty), (Bridge::Open, 0));
    }
}

/// What the first commissioning has found must not bound the excitation of the second.
#[test]
fn a_second_commissioning_sees_the_saturation_again() {
    let mut plant = plant();
    plant.motor.drive.limit_v = [8.5, 8.5];
    plant.truth = Truth::of(&plant.motor);
    let mut bench = Bench::new(&plant);
    run(&mut bench, 0.01);
    for number in 1..=2 {
        must(&mut bench, Command::Arm);
        must(&mut bench, COMMISSION);
        run(&mut bench, 6.0);
        let estimates = bench.axis.report(&bench.state).commissioning.expect("an outcome").estimates;
        for found in [estimates.saturation_pos_v, estimates.saturation_neg_v] {
            let level = found.value.unwrap_or(0.0);
            assert!((level - 8.5).abs() < 0.1, "commissioning {number}: {found:?}");
        }
    }
}
