//! Recordings: limits of travel, voltage and energy are kept on drawn motors, and the log says what is hidden.

use servo::axis::{Bridge, Sample};
use servo::config::Config;
use servo::optional::Optional;
use servo::protect::Settings;
use servo::store::AxisParameters;
use std::process::Command;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::host_servo::{HostServo, Outside};
use trials::virtual_motor::VirtualMotor;
use truing::console::interrupt;
use truing::device::link::Wire;
use truing::device::motor::{Builtin, Motor};
use truing::device::session::{Listening, Progress};
use truing::device::setup::Setup;
use truing::gap;
use truing::improve::record::{self, Limits, Plan, Recorded, Segment};
use truing::system::effects;
use truing::system::log::{self, Columns, Log};
use truing::system::model;

/// Just switched on, with nothing in its flash.
fn servo(motor: impl Motor + 'static, config: Config) -> Box<dyn Wire> {
    Box::new(HostServo::power_up(Box::new(motor), config, &Outside::default()))
}

fn recorded(wire: Box<dyn Wire>, config: Config, plan: &Plan, every: u32) -> Recorded {
    let setup = Setup::from(config);
    record::run(wire, &setup, Listening { axis: 0, every }, plan, &mut |_| {}).expect("a recording")
}

/// A drawn plant with a hint that is off as far as it may be.
fn random_plant(family: Family, seed: u32) -> (Plant, Config) {
    let plant = Plant::draw(family, Severity::Harsh, Seeds::Design(710_000 + seed), &Options::default());
    let off = [0.55, 1.0, 1.9][seed as usize % 3];
    let hint = (plant.truth.time_constant_s * off) as f32;
    let config = Config { time_constant_hint_s: Optional::new(hint), ..plant.config };
    (plant, config)
}

#[test]
fn no_recording_leaves_its_travel_and_its_voltage() {
    let mut far = 0;
    for (family, travel) in [(Family::G1, 40.0), (Family::G2, 8.0), (Family::G3, 0.8)] {
        for seed in 0..4 {
            for every in [1, 3] {
                let (plant, config) = random_plant(family, seed);
                let limit = 0.7 * config.supply_nominal_v;
                let config = Config { voltage_limit_v: Optional::new(limit), ..config };
                let limits = Limits { travel_rad: Some(travel), ..Limits::default() };
                let gear = f64::from(config.gear_ratio);
                let plan = Plan::new(&config, None, &limits, u64::from(seed)).expect("a plan");
                let line = servo(VirtualMotor::new(&plant), config);
                let recorded = recorded(line, config, &plan, every);
                let what = format!("{family:?} {seed} every {every}: {:?}", recorded.session.broken);
                assert_eq!(recorded.session.broken, None, "{what}");
                let [lower, upper] = recorded.reach_rad;
                assert!(lower > -travel * gear && upper < travel * gear, "{what}: {lower} … {upper} rad");
                // Where commands act late and little is known, a stubborn motor may not be given what moves it.
                let moved = !recorded.hardly_moved(&plan);
                assert!(every > 1 || moved, "{what}: it moves, {lower} … {upper} rad");
                far += u32::from(every > 1 && moved);
                let log = &recorded.session.log;
                let most = log.rows.iter().filter(|row| row.record.bridge == Bridge::Driven).map(|row| {
                    let share = f64::from(row.record.duty) / f64::from(config.pwm_full_scale);
                    (share * log.supply_v(&row.record)).abs()
                });
                // The supply's reading is noisy, and the limit acts on the reading before.
                let most = most.fold(0.0, f64::max);
                assert!(most <= 1.03 * f64::from(limit), "{what}: {most} V");
            }
        }
    }
    assert!(far >= 6, "with late commands {far} of 12 motors move");
}

#[test]
fn no_recording_spends_more_than_it_may() {
    let mut cut = 0;
    for seed in 0..12 {
        let (plant, config) = random_plant(Family::G2, seed);
        if !plant.sensing.current {
            continue;
        }
        let limits = Limits { energy_j: Some(3.0), ..Limits::default() };
        let plan = Plan::new(&config, None, &limits, u64::from(seed)).expect("a plan");
        let line = servo(VirtualMotor::new(&plant), config);
        let recorded = recorded(line, config, &plan, 1);
        assert_eq!(recorded.session.broken, None, "{seed}");
        let energy = recorded.energy_j.expect("it measures the current");
        assert!(energy <= 3.0, "{seed}: {energy} J");
        assert!(!recorded.spent || energy > 1.5, "{seed}: given up at {energy} J");
        cut += u32::from(recorded.spent);
        let last = recorded.session.log.rows.last().expect("rows").record;
        assert_eq!(last.command_bridge, Bridge::Open, "{seed}");
    }
    assert!(cut > 0, "no motor has met the limit");
}

#[test]
fn a_limit_of_energy_without_a_current_sensor_is_refused() {
    let (mut plant, config) = random_plant(Family::G2, 1);
    plant.sensing.current = false;
    let limits = Limits { energy_j: Some(3.0), ..Limits::default() };
    let plan = Plan::new(&config, None, &limits, 1).expect("a plan");
    let line = servo(VirtualMotor::new(&plant), config);
    let setup = Setup::from(config);
    let refused = record::run(line, &setup, Listening { axis: 0, every: 1 }, &plan, &mut |_| {});
    let text = refused.expect_err("no sensor").to_string();
    assert!(text.contains("measured current"), "{text}");
    assert_eq!(Sample::sensed(Sample::CURRENT_NOT_SENSED), None);
}

#[test]
fn a_plan_is_drawn_from_its_seed_and_fits_its_budget() {
    let config = Config { time_constant_hint_s: Optional::new(0.15), ..Config::EXAMPLE };
    let plan = |seed, limits| Plan::new(&config, None, &limits, seed);
    let [one, again, other] = [3, 3, 4].map(|seed| plan(seed, Limits::default()).expect("a plan"));
    assert_eq!(one, again);
    assert_ne!(one.segments, other.segments);
    assert!(one.seconds <= record::BUDGET_S, "{} s", one.seconds);
    assert_eq!(one.segments.first(), one.segments.last());
    let half = one.segments.len() / 2;
    assert_eq!(one.segments[..half], one.segments[half..2 * half]);
    let short = plan(3, Limits { budget_s: Some(16.0), ..Limits::default() }).expect("a shorter plan");
    assert!(short.seconds <= 16.0);
    plan(3, Limits { budget_s: Some(2.0), ..Limits::default() }).expect_err("too short");
    let unknown = Config { time_constant_hint_s: Optional::NONE, ..config };
    Plan::new(&unknown, None, &Limits::default(), 1).expect_err("nothing to scale by");
    let chosen = one.with(vec![Segment::reversals(&one.scale, 0.5)]);
    assert!(chosen.seconds < 3.0, "{} s", chosen.seconds);
}

const SHEET: &str = "schema = \"truing-model/1\"\n[motor]\nR_ohm = 3.0\nKt_nm_per_a = 0.25\nJ_kgm2 = 4e-3\n\
                     b_nms_per_rad = 1e-4\n[supply]\nnominal_v = 12.0\n[encoder]\ncounts_per_rev = 4096\n";

/// Names that the gap workflow finds in a recording of this motor.
fn named(hidden: &str, limits: &Limits) -> Vec<String> {
    let model = |text: &str| model::parse("motor.toml", text).expect("a model");
    let config = Config {
        counts_per_rev: 4096,
        rated_speed_rad_s: 42.0,
        tick_hz: 1000,
        time_constant_hint_s: Optional::new(0.24),
        ..Config::EXAMPLE
    };
    let truth = model(&format!("{SHEET}{hidden}"));
    let plan = Plan::new(&config, None, limits, 5).expect("a plan");
    let line = servo(Builtin::new(&truth, &config, 5), config);
    let recorded = recorded(line, config, &plan, 1);
    assert_eq!(recorded.session.broken, None);
    let columns = Columns::default();
    let Log::Dynamic(series) = log::parse("run.csv", &recorded.to_csv(&plan), &columns).expect("a log")
    else {
        panic!("a log over time");
    };
    let outcome =
        gap::run(&model(SHEET), &series, &[], &gap::Options::default(), &|_| {}).expect("an outcome");
    outcome.effects.iter().map(|effect| effect.name.to_owned()).collect()
}

#[test]
fn a_recording_names_hidden_friction() {
    let hidden = format!("[known.{}]\nlevel_nm = 0.06\n", effects::COULOMB_FRICTION.name);
    assert_eq!(named(&hidden, &Limits::default()), [effects::COULOMB_FRICTION.name]);
}

#[test]
fn a_recording_names_a_hidden_dead_zone() {
    let hidden = format!("[known.{}]\nhalf_width_v = 0.8\n", effects::DEAD_ZONE.name);
    assert_eq!(named(&hidden, &Limits::default()), [effects::DEAD_ZONE.name]);
}

#[test]
fn a_recording_within_a_short_travel_names_hidden_gravity() {
    let hidden = format!("[known.{}]\nmgl_nm = 0.12\nphase_rad = 0.0\n", effects::GRAVITY.name);
    let limits = Limits { travel_rad: Some(1.5), ..Limits::default() };
    assert_eq!(named(&hidden, &limits), [effects::GRAVITY.name]);
}

/// A servo that has been set up before: with end stops, with a time-out that the axis file does not know, and with what a
/// commissioning has found. What is in force is told by `outside`.
fn set_up(seed: u32, outside: &Outside) -> (Box<dyn Wire>, Config, AxisParameters) {
    let (plant, config) = random_plant(Family::G2, seed);
    let config = Config { travel_limit_rad: Some([-6.0, 6.0]), ..config };
    let fresh = Setup::from(config).parameters(None);
    let chosen = AxisParameters {
        protection: Settings { command_timeout_ms: 750, ..fresh.protection },
        compensation: false,
        ..fresh
    };
    outside.stored.replace(Some(chosen));
    let mut servo = HostServo::power_up(Box::new(VirtualMotor::new(&plant)), config, outside);
    servo.turn(&mut Vec::new(), &mut Vec::new()).expect("a tick");
    let before = outside.in_force.borrow().expect("it has been set up");
    assert_eq!(before.protection.command_timeout_ms, 750);
    (Box::new(servo), config, before)
}

/// What a recording leaves behind in every case.
fn assert_as_before(outside: &Outside, before: &AxisParameters, recorded: &Recorded) {
    assert_eq!(outside.bridge.get(), Bridge::Open);
    assert_eq!(outside.in_force.borrow().as_ref(), Some(before));
    let log = &recorded.session.log;
    assert!(log.rows.len() > 500, "{} rows", log.rows.len());
    assert_eq!(log.rows.last().map(|row| row.record.bridge), Some(Bridge::Open));
}

#[test]
fn a_servo_has_its_own_settings_again_behind_a_recording() {
    let mut energy_j = None;
    // A whole one, and one that is cut short in the midst of a motion.
    for spent in [false, true] {
        let outside = Outside::default();
        let (line, config, before) = set_up(3, &outside);
        let limits = Limits { energy_j, ..Limits::default() };
        let plan = Plan::new(&config, None, &limits, 3).expect("a plan");
        let recorded = recorded(line, config, &plan, 1);
        assert_eq!(recorded.session.broken, None);
        assert_eq!(recorded.spent, spent);
        assert_as_before(&outside, &before, &recorded);
        energy_j = recorded.energy_j.map(|energy| 0.4 * energy);
    }
}

#[test]
fn an_axis_file_is_in_force_with_its_end_stops_behind_a_recording() {
    let (plant, config) = random_plant(Family::G2, 4);
    let config = Config { travel_limit_rad: Some([-6.0, 6.0]), ..config };
    let outside = Outside::default();
    let line = HostServo::power_up(Box::new(VirtualMotor::new(&plant)), config, &outside);
    let plan = Plan::new(&config, None, &Limits::default(), 4).expect("a plan");
    assert_eq!(recorded(Box::new(line), config, &plan, 1).session.broken, None);
    assert_eq!(*outside.in_force.borrow(), Some(Setup::from(config).parameters(None)));
}

#[test]
fn a_servo_whose_wire_is_lost_opens_its_bridge_and_the_log_is_kept() {
    for travel in [Some([-6.0, 6.0]), None] {
        let (plant, config) = random_plant(Family::G2, 5);
        let config = Config { travel_limit_rad: travel, ..config };
        let outside = Outside::default();
        outside.lost_at.set(Some(2 * config.tick_hz));
        let line = HostServo::power_up(Box::new(VirtualMotor::new(&plant)), config, &outside);
        let plan = Plan::new(&config, None, &Limits::default(), 5).expect("a plan");
        let recorded = recorded(Box::new(line), config, &plan, 1);
        let text = recorded.session.broken.as_ref().expect("it is lost").to_string();
        assert!(text.contains("the line is lost") && text.contains("switch it off and on"), "{text}");
        assert!(recorded.session.log.rows.len() > 500, "{} rows", recorded.session.log.rows.len());
        assert_eq!(outside.bridge.get(), Bridge::Open, "{travel:?}");
        assert!(outside.in_force.borrow().is_some(), "a host that is soon back finds all as it was");
    }
}

/// The settings of a recording know no end stops.
#[test]
fn a_servo_that_is_left_alone_in_a_recording_forgets_its_settings() {
    let (plant, config) = random_plant(Family::G2, 5);
    let outside = Outside::default();
    outside.lost_at.set(Some(2 * config.tick_hz));
    outside.lives_on_s.set(60);
    let line = HostServo::power_up(Box::new(VirtualMotor::new(&plant)), config, &outside);
    let plan = Plan::new(&config, None, &Limits::default(), 5).expect("a plan");
    let recorded = recorded(Box::new(line), config, &plan, 1);
    assert!(recorded.session.broken.is_some());
    assert_eq!(*outside.in_force.borrow(), None);
}

/// Set in the process that is interrupted: an interruption ends all sessions of its process.
const INTERRUPTED: &str = "TRUING_TEST_INTERRUPTED";

#[test]
fn an_interruption_opens_the_bridge_puts_back_what_was_in_force_and_keeps_the_log() {
    if std::env::var_os(INTERRUPTED).is_none() {
        let name = "record::an_interruption_opens_the_bridge_puts_back_what_was_in_force_and_keeps_the_log";
        let this = std::env::current_exe().expect("a path");
        let told =
            Command::new(this).args(["--exact", name]).env(INTERRUPTED, "1").output().expect("it runs");
        assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stdout));
        assert!(String::from_utf8_lossy(&told.stdout).contains("1 passed"));
        return;
    }
    let outside = Outside::default();
    let (line, config, before) = set_up(3, &outside);
    let plan = Plan::new(&config, None, &Limits::default(), 3).expect("a plan");
    let listening = Listening { axis: 0, every: 1 };
    let mut interrupt = |_: Progress| {
        if outside.bridge.get() == Bridge::Driven && outside.ticks.get() > 2_000 {
            interrupt::ask();
        }
    };
    let recorded = record::run(line, &config.into(), listening, &plan, &mut interrupt).expect("a recording");
    let text = recorded.session.broken.as_ref().expect("it is interrupted").to_string();
    assert_eq!(text, "interrupted: the servo was stopped, its bridge is open");
    assert_as_before(&outside, &before, &recorded);
    let read = log::parse("run.csv", &recorded.to_csv(&plan), &Columns::default());
    assert!(matches!(read, Ok(Log::Dynamic(_))), "{read:?}");
}
