//! The limits that a user asks for: set-points keep acceleration and jerk, terminals the voltage, protection the thresholds
//! of the supply.

use servo::axis::Command;
use servo::axis::{Output, Refusal};
use servo::config::{Config, ConfigError, Field};
use servo::link::protocol::Command as Wire;
use servo::motion::excitation::{Sweep, Waveform};
use servo::optional::Optional;
use servo::protect::Fault;
use servo::record::{Activity, Limit};
use std::f64::consts::TAU;
use trials::bench::Bench;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::simulated_servo::{self, SimulatedServo};
use trials::tracking::{feed_forward, knowing};

const ACCELERATION: f32 = 150.0;
const JERK: f32 = 3_000.0;
/// What rounding of set-points adds: half a count per tick² in 2²⁴, speeds in 2²⁰, seen as differences.
const LEAST_SPEED: f64 = 1.0 / (1 << 20) as f64;

fn plant(limits: impl Fn(&mut Config)) -> Plant {
    let options = Options::default();
    let mut plant = Plant::draw(Family::G2, Severity::Nominal, Seeds::Design(43), &options);
    limits(&mut plant.config);
    plant
}

fn gentle(config: &mut Config) {
    config.acceleration_limit_rad_s2 = Optional::new(ACCELERATION);
    config.jerk_limit_rad_s3 = Optional::new(JERK);
}

/// Largest acceleration and jerk of the set-points, rad/s² and rad/s³, by differences of their speed.
#[derive(Default)]
struct Peaks {
    speeds: Vec<f64>,
}

impl Peaks {
    fn see(&mut self, output: &Output) {
        assert_eq!(output.record.fault, Fault::None, "tick {}", output.record.tick);
        self.speeds.push(f64::from(output.record.reference_speed_q20) * LEAST_SPEED);
    }

    fn of(&self, config: &Config) -> [f64; 2] {
        let (hz, per_rad) = (f64::from(config.tick_hz), f64::from(config.counts_per_rev) / TAU);
        let largest = |values: &mut dyn Iterator<Item = f64>, rounding: f64| {
            values.fold(0.0, |most: f64, value| most.max(value.abs() - rounding))
        };
        let steps = self.speeds.windows(2).map(|w| w[1] - w[0]);
        let bends = self.speeds.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]);
        [
            largest(&mut { steps }, LEAST_SPEED) * hz.powi(2) / per_rad,
            largest(&mut { bends }, 2.0 * LEAST_SPEED) * hz.powi(3) / per_rad,
        ]
    }
}

fn run(bench: &mut Bench, ticks: u32, peaks: &mut Peaks) -> Output {
    let mut last = Output::default();
    for _ in 0..ticks {
        last = bench.tick();
        peaks.see(&last);
    }
    last
}

#[test]
fn moves_use_the_limits_and_keep_them() {
    let plant = plant(gentle);
    for rad in [0.05f32, 0.5, -2.0, 10.0] {
        let mut bench = knowing(&plant);
        let mut peaks = Peaks::default();
        bench.ask(Command::Position(rad)).expect("a target");
        let last = run(&mut bench, 4_000, &mut peaks);
        assert_eq!(last.record.activity, Activity::Holding, "{rad}");
        let [acceleration, jerk] = peaks.of(&plant.config).map(|peak| peak as f32);
        println!("{rad} rad: {acceleration} rad/s², {jerk} rad/s³");
        assert!(acceleration <= 1.01 * ACCELERATION && jerk <= 1.01 * JERK, "{rad}");
        assert!(acceleration > 0.9 * ACCELERATION || jerk > 0.9 * JERK, "{rad}: slower than need be");
    }
}

#[test]
fn targets_that_change_in_motion_keep_them_too() {
    let plant = plant(gentle);
    for turn in 1..40 {
        let mut bench = knowing(&plant);
        let mut peaks = Peaks::default();
        bench.ask(Command::Position(3.0)).expect("a target");
        run(&mut bench, 15 * turn, &mut peaks);
        bench.ask(Command::Position(if turn % 2 == 0 { -1.0 } else { 4.0 })).expect("another");
        let last = run(&mut bench, 6_000, &mut peaks);
        assert_eq!(last.record.activity, Activity::Holding, "{turn}");
        let [acceleration, jerk] = peaks.of(&plant.config).map(|peak| peak as f32);
        // Acceleration: the bound for a course that starts accelerating is not exact.
        assert!(acceleration <= 1.05 * ACCELERATION && jerk <= 1.01 * JERK, "{turn}: {acceleration} {jerk}");
    }
}

#[test]
fn speeds_and_streams_keep_them() {
    let plant = plant(gentle);
    let mut bench = knowing(&plant);
    let mut peaks = Peaks::default();
    for speed in [20.0f32, -15.0, 0.0] {
        bench.ask(Command::Speed(speed)).expect("a speed");
        run(&mut bench, 1_500, &mut peaks);
    }
    let [acceleration, jerk] = peaks.of(&plant.config).map(|peak| peak as f32);
    assert!(acceleration <= 1.01 * ACCELERATION && jerk <= 1.01 * JERK, "{acceleration} {jerk}");
    assert!(acceleration > 0.9 * ACCELERATION || jerk > 0.9 * JERK, "{acceleration} {jerk}");

    // Streamed points that ask for ten times the acceleration: it is held, and told.
    let mut peaks = Peaks::default();
    let mut told = 0;
    for number in 0..400u32 {
        if number % 40 == 0 {
            let position_rad = if number % 80 == 0 { 1.5 } else { -1.5 };
            let point = servo::motion::stream::Point {
                position_rad,
                speed_rad_s: 0.0,
                acceleration_rad_s2: None,
                ticks: 60,
            };
            bench.ask(Command::Stream(point)).expect("room");
        }
        let output = bench.tick();
        peaks.see(&output);
        told += u32::from(output.record.limit == Limit::Acceleration);
    }
    let [acceleration, _] = peaks.of(&plant.config).map(|peak| peak as f32);
    assert!(acceleration <= 1.01 * ACCELERATION && told > 100, "{acceleration}, told {told} times");
}

#[test]
fn a_sine_beyond_them_is_refused_and_one_within_keeps_them() {
    let plant = plant(gentle);
    let sine = |amplitude_rad: f32, frequency_hz: f32, turns: f32| Command::TrackSine {
        amplitude_rad,
        frequency_hz,
        duration_ms: (turns / frequency_hz * 1000.0) as u32,
    };
    // By hand: A·(2πf)² and A·(2πf)³ with one turn of rise, 1 + 6.2/4π² and 1 + 17/4π² + 47/16π⁴.
    for (hertz, turns, factor) in [(1.0f32, 5.0, 1.157), (4.0, 5.0, 1.461), (1.0, 1.0, 1.7)] {
        let radians = std::f32::consts::TAU * hertz;
        let by_jerk = radians > JERK / ACCELERATION;
        let most = if by_jerk { JERK / radians.powi(3) } else { ACCELERATION / radians.powi(2) } / factor;
        let mut bench = knowing(&plant);
        assert_eq!(bench.ask(sine(1.1 * most, hertz, turns)), Err(Refusal::OutOfRange), "{hertz} Hz");
        bench.ask(sine(0.9 * most, hertz, turns)).unwrap_or_else(|error| panic!("{hertz} Hz: {error:?}"));
        let mut peaks = Peaks::default();
        run(&mut bench, (turns / hertz * 1000.0) as u32, &mut peaks);
        let [acceleration, jerk] = peaks.of(&plant.config).map(|peak| peak as f32);
        assert!(acceleration <= ACCELERATION && jerk <= JERK, "{hertz} Hz: {acceleration} {jerk}");
    }
}

/// With the voltage limit, with a low supply, with a saturation: a tenth too much is refused with both numbers, and what
/// is left is done. 2.4 times the speed limit: as well.
#[test]
fn a_sine_that_takes_more_voltage_than_is_left_is_refused_with_the_numbers() {
    let limited = |config: &mut Config| config.voltage_limit_v = Optional::new(0.6 * config.supply_nominal_v);
    for (what, share, plant) in
        [("limit", 1.0, plant(limited)), ("supply", 0.7, plant(|_| {})), ("saturation", 1.0, plant(|_| {}))]
    {
        let mut bench = knowing(&plant);
        bench.board.supply_falls_to(share);
        bench.run(0.1, |_, _| {});
        let supply_v = plant.motor.drive.supply_v;
        let top = match what {
            "limit" => 0.6 * supply_v,
            "supply" => share * supply_v,
            _ => f64::INFINITY,
        };
        let side = |side: usize| {
            let saturation = plant.truth.saturation_v[side].unwrap_or(supply_v);
            saturation.min(top) - plant.truth.dead_zone_v[side]
        };
        let left = side(0).min(side(1));
        let fits = left / feed_forward(&plant, 1.0, 2.0);
        let sine = |share: f64| Command::TrackSine {
            amplitude_rad: (share * fits) as f32,
            frequency_hz: 2.0,
            duration_ms: 2_000,
        };
        let Err(Refusal::BeyondVoltage { needed_v, available_v }) = bench.ask(sine(1.15)) else {
            panic!("{what}: a sine with 1.15 times the voltage is not refused");
        };
        let wrong = (f64::from(available_v) / left - 1.0).abs() + (f64::from(needed_v) / left - 1.15).abs();
        assert!(wrong < 0.04, "{what}: needs {needed_v} V of {available_v} V, {left} V are left");
        bench.ask(sine(1.0)).unwrap_or_else(|refusal| panic!("{what}: {refusal:?}"));
    }
    let plant = plant(|config| config.speed_limit_rad_s = Optional::new(0.1 * config.rated_speed_rad_s));
    let fast = Command::TrackSine {
        amplitude_rad: 0.24 * plant.config.rated_speed_rad_s / std::f32::consts::TAU,
        frequency_hz: 1.0,
        duration_ms: 3_000,
    };
    let refused = knowing(&plant).ask(fast);
    assert!(matches!(refused, Err(Refusal::BeyondSpeed { .. })), "{refused:?}");
}

/// A rated speed within 30 % and a hint within a factor of 2 refuse only what no such motor can do.
#[test]
fn a_motor_that_is_not_identified_is_refused_only_what_is_impossible() {
    let plant = plant(|config| config.time_constant_hint_s = Optional::new(0.05));
    let mut bench = Bench::new(&plant);
    bench.ask(Command::Arm).expect("no fault");
    let sine = |share: f32| Command::TrackSine {
        amplitude_rad: share * plant.config.rated_speed_rad_s / (2.0 * std::f32::consts::TAU),
        frequency_hz: 2.0,
        duration_ms: 2_000,
    };
    let refused = bench.ask(sine(1.6));
    assert!(matches!(refused, Err(Refusal::BeyondVoltage { .. })), "{refused:?}");
    bench.ask(sine(1.2)).expect("possible within what is known");
}

#[test]
fn nothing_puts_more_than_the_voltage_limit_at_the_terminals() {
    let share = 0.6;
    let plant = plant(|config| config.voltage_limit_v = Optional::new(share * config.supply_nominal_v));
    let volts = share * plant.config.supply_nominal_v;
    let mut bench = knowing(&plant);
    let most = |output: &Output| {
        let supply = f32::from(output.record.vbus_raw) * plant.config.vbus_v_per_lsb;
        f32::from(output.duty).abs() / f32::from(plant.config.pwm_full_scale) * supply
    };
    assert_eq!(bench.ask(Command::Voltage(1.01 * volts)), Err(Refusal::OutOfRange));
    let waveform = Waveform {
        amplitude_v: 1.01 * volts,
        from_hz: 1.0,
        to_hz: 1.0,
        sweep: Sweep::Linear,
        duration_ms: 1000,
    };
    let refused = bench.ask(Command::Excite(waveform));
    assert!(matches!(refused, Err(Refusal::Value(ConfigError { field: Field::ExcitationAmplitude, .. }))));

    // A sine that this motor can just not follow with so little.
    let left = f64::from(volts) - plant.truth.dead_zone_v[0].max(plant.truth.dead_zone_v[1]);
    let sine = Command::TrackSine {
        amplitude_rad: (1.08 * left / feed_forward(&plant, 1.0, 1.0)) as f32,
        frequency_hz: 1.0,
        duration_ms: 3_000,
    };
    bench.ask(sine).expect("a sine");
    let (mut highest, mut told) = (0.0f32, 0);
    for _ in 0..3_000 {
        let output = bench.tick();
        highest = highest.max(most(&output));
        told += u32::from(output.record.limit == Limit::Voltage);
    }
    println!("{highest} V of {volts} V, told {told} times");
    assert!(
        highest <= 1.02 * volts && highest > 0.97 * volts && told > 300,
        "{highest} V, told {told} times"
    );
}

/// The commissioning looks for the dead zone with what it may give, and does not take the limit for a saturation.
#[test]
fn a_commissioning_keeps_the_voltage_limit_and_learns_the_dead_zone() {
    let share = 0.75;
    let plant = plant(|config| config.voltage_limit_v = Optional::new(share * config.supply_nominal_v));
    let mut bench = Bench::new(&plant);
    bench.run(0.01, |_, _| {});
    bench.ask(Command::Arm).expect("armed");
    bench.ask(Command::Commission { budget_ms: 8_000, seed: 1 }).expect("idle");
    let full = f32::from(plant.config.pwm_full_scale);
    let mut highest = 0.0f32;
    for _ in 0..40_000 {
        let output = bench.tick();
        let supply = f32::from(output.record.vbus_raw) * plant.config.vbus_v_per_lsb;
        highest = highest.max(f32::from(output.duty).abs() / full * supply / plant.config.supply_nominal_v);
        if bench.state.outcome().is_some() {
            break;
        }
    }
    let outcome = bench.state.outcome().expect("it ends");
    let report = outcome.estimates.report(bench.axis.scale());
    println!("{highest} of nominal, {report:?}, truth {:?}", plant.truth);
    // A hundredth for the supply, which is converted anew and smoothed.
    assert!((0.7..=0.765).contains(&highest), "{highest}");
    assert_eq!(outcome.refused, None);
    for (found, truth) in [report.dead_zone_pos_v, report.dead_zone_neg_v].iter().zip(plant.truth.dead_zone_v)
    {
        let value = f64::from(found.value.expect("a number"));
        assert!(found.trusted && (value / truth - 1.0).abs() < 0.1, "{found:?}, truth {truth}");
    }
    for found in [report.saturation_pos_v, report.saturation_neg_v] {
        let value = found.value.unwrap_or(f32::MAX);
        assert!(!found.trusted || value > 1.02 * share * plant.config.supply_nominal_v, "{found:?}");
    }
}

#[test]
fn the_supply_is_a_fault_beyond_the_thresholds_asked_for_and_not_before() {
    // 0.01 V a count of the servo_under_test's converter, 12 V nominal.
    for (limits, inside, outside, fault) in [
        ((None, None), 610, 590, Fault::SupplyLow),
        ((None, None), 1790, 1810, Fault::SupplyHigh),
        ((Some(10.5), None), 1060, 1040, Fault::SupplyLow),
        ((Some(10.5), Some(15.0)), 1490, 1510, Fault::SupplyHigh),
        ((Some(3.0), Some(22.0)), 310, 290, Fault::SupplyLow),
        ((Some(3.0), Some(22.0)), 2190, 2210, Fault::SupplyHigh),
    ] {
        let mut servo_under_test = SimulatedServo::default();
        let (supply_low_v, supply_high_v) = limits;
        let config = Config {
            supply_low_v: supply_low_v.into(),
            supply_high_v: supply_high_v.into(),
            ..simulated_servo::config()
        };
        servo_under_test.order(Wire::Configure(config)).expect("a configuration");
        servo_under_test.world.vbus_raw = inside;
        assert_eq!(servo_under_test.ticks(2_000).record.fault, Fault::None, "{limits:?} at {inside}");
        servo_under_test.world.vbus_raw = outside;
        assert_eq!(
            servo_under_test.ticks(40).record.fault,
            Fault::None,
            "{limits:?} at {outside}: 5 ms have to pass"
        );
        assert_eq!(servo_under_test.ticks(40).record.fault, fault, "{limits:?} at {outside}");
    }
}

#[test]
fn limits_that_cannot_be_are_refused_with_their_range() {
    let nominal = simulated_servo::config().supply_nominal_v;
    let config = simulated_servo::config;
    for (config, field, minimum, maximum) in [
        (
            Config { supply_low_v: Optional::new(12.1), ..config() },
            Field::SupplyLow,
            0.125 * nominal,
            nominal,
        ),
        (
            Config { supply_high_v: Optional::new(24.0), ..config() },
            Field::SupplyHigh,
            nominal,
            1.9 * nominal,
        ),
        (
            Config { acceleration_limit_rad_s2: Optional::new(0.0), ..config() },
            Field::AccelerationLimit,
            0.1,
            1e7,
        ),
        (Config { jerk_limit_rad_s3: Optional::new(f32::NAN), ..config() }, Field::JerkLimit, 0.1, 1e10),
        (
            Config { voltage_limit_v: Optional::new(12.5), ..config() },
            Field::VoltageLimit,
            0.1 * nominal,
            nominal,
        ),
    ] {
        assert_eq!(config.build(), Err(ConfigError { field, minimum, maximum }));
    }
}

/// Thresholds that were chosen before stay, and must fit the supply of the new configuration.
#[test]
fn limits_survive_a_new_configuration() {
    let mut servo_under_test = SimulatedServo::default();
    let config = Config {
        supply_low_v: Optional::new(10.0),
        voltage_limit_v: Optional::new(9.0),
        ..simulated_servo::config()
    };
    servo_under_test.order(Wire::Configure(config)).expect("a configuration");
    servo_under_test.order(Wire::Configure(simulated_servo::config())).expect("the same machine");
    servo_under_test.world.vbus_raw = 950;
    assert_eq!(servo_under_test.ticks(100).record.fault, Fault::SupplyLow);
    servo_under_test.order(Wire::Stop).expect("always possible");
    servo_under_test.world.vbus_raw = 1200;
    servo_under_test.tick();
    for (volts, fits) in [(8.9, true), (9.1, false)] {
        servo_under_test.order(Wire::Arm).expect("no fault");
        let result = servo_under_test.order(Wire::Voltage(volts));
        assert_eq!(result.is_ok(), fits, "{volts} V: {result:?}");
    }
    servo_under_test.order(Wire::Stop).expect("always possible");
    servo_under_test.ticks(3);
    let small = Config { supply_nominal_v: 6.0, ..simulated_servo::config() };
    let refused = servo_under_test.order(Wire::Configure(small));
    assert!(refused.is_err(), "9 V of 6 V: {refused:?}");
}
