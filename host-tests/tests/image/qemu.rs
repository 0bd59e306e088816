//! The firmware image in QEMU: same bits as the library, any program as the motor, and clear words when something is
//! missing.

use clap::Parser;
use servo::config::Config;
use servo::link::capture::{LENGTH, Shot, Stage, Trigger};
use servo::link::protocol::Command;
use servo::optional::Optional;
use servo::record::{Activity, Source};
use std::path::Path;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::faults::commissioning::{Flaw, FlawedMotor};
use trials::firmware::{compare, qemu, session};
use truing::cli::Cli;
use truing::device::axis_file;
use truing::device::commission_report::{CommissionJson, Params};
use truing::device::link::{Client, Lockstep};
use truing::device::motor::qemu::{Options as QemuOptions, Qemu};
use truing::device::motor::{Door, Drive, Exec, Motor};
use truing::device::replay::replay;
use truing::device::run_log::Tape;
use truing::device::session::{self, Done, Profile, Task};
use truing::device::tracking::TrackJson;
use truing::device::waypoints::Waypoint;

const COMMISSION: Task = Task::Commission { budget_s: 5.0, seed: 1 };

/// A motor whose numbers are known: 1.0 V of friction, limit 9.5 V (see the file).
fn python_motor() -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../workbench/examples/motor.py");
    format!("exec python3 '{}'", file.display())
}

const AXIS: &str = "
    [supply]
    nominal_v = 12.0
    [encoder]
    counts_per_rev = 2048
    [axis]
    rated_speed_rad_s = 170.0
    tick_hz = 1000
";

fn config() -> servo::config::Config {
    axis_file::parse("axis.toml", AXIS).expect("a good file").config
}

fn sine(seconds: f32) -> Task {
    Task::Track {
        profile: Profile::Sine { amplitude_rad: 2.0, frequency_hz: 1.0, seconds },
        compensation: true,
    }
}

#[test]
fn chip_and_host_compute_the_same_bits() {
    let plants = [
        (Family::G1, Severity::Harsh, 1_000),
        (Family::G3, Severity::Nominal, 1_000),
        (Family::G2, Severity::Harsh, 10_000),
    ];
    for (number, (family, severity, tick_hz)) in (0..).zip(plants) {
        let options = Options { tick_hz, ..Options::default() };
        let plant = Plant::draw(family, severity, Seeds::Evaluation(400_000 + number), &options);
        let (result, verdict) = compare(&plant, &[COMMISSION]).expect("a session");
        assert!(verdict.identical(), "{family:?} at {tick_hz} Hz: {verdict}");
        assert_eq!(verdict.commissionings, 1);
        assert!(verdict.ticks > 4 * tick_hz as usize, "{verdict}");
        assert!(matches!(&result.done[..], [Done::Commissioned(outcome)] if outcome.refused.is_none()));
    }
}

/// Limits survive a new description of the machine, in which they may be out of the converters' reach.
#[test]
fn a_limit_that_is_kept_must_be_within_reach_of_the_new_converter() {
    let wire = session::connect(&Door::Exec(python_motor()), &config(), 1, &qemu()).expect("a motor");
    let mut client = Client::new(wire);
    let mut configure = |limit: Optional, per_lsb| {
        let config = Config { current_limit_a: limit, current_a_per_lsb: per_lsb, ..config() };
        client.command(Command::Configure(config), &mut |_| {})
    };
    configure(Optional::new(100.0), 0.01).expect("10,000 of 32,767 counts");
    let refused = configure(Optional::NONE, 0.001).expect_err("100,000 counts").to_string();
    assert!(refused.contains("limits.current_a must lie between 0 and 30.8"), "{refused}");
    configure(Optional::NONE, 0.005).expect("20,000 counts");
}

#[test]
fn one_changed_bit_is_found() {
    let plant = Plant::draw(Family::G1, Severity::Nominal, Seeds::Evaluation(400_010), &Options::default());
    let result = session(&plant, &[Task::Commission { budget_s: 2.0, seed: 0 }]).expect("a session");
    let tape = result.log.tape();
    let at = tape.traces.len() / 2;

    let mut other_input = tape.clone();
    other_input.traces[at].sample.count += 1;
    let difference = replay(&other_input).expect("a whole tape").difference.expect("one count differs");
    assert_eq!(difference.tick, tape.traces[at].tick);

    let mut other_result = tape.clone();
    other_result.outcomes[0].1.estimates.dead_zone[0].value ^= 1;
    assert!(!replay(&other_result).expect("a whole tape").identical());

    let mut missing = tape;
    missing.traces.remove(at);
    let error = replay(&missing).expect_err("a tick is missing").to_string();
    assert!(error.contains("every control tick"), "{error}");
}

#[test]
fn a_log_file_replays_like_the_session() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.csv");
    let door = Door::Exec(python_motor());
    let wire = session::connect(&door, &config(), 1, &qemu()).expect("a motor");
    let result = session::run(wire, config(), 1, &[COMMISSION, sine(2.0)], &mut |_| {}).expect("a session");
    result.log.save(&path).expect("a file");
    let tape = Tape::read(&path, &config()).expect("a tape");
    assert_eq!(tape, result.log.tape());
    let verdict = replay(&tape).expect("a replay");
    assert!(verdict.identical(), "{verdict}");
    assert!(tape.commands.iter().any(|(_, command)| matches!(command, Command::TrackSine { .. })));
}

#[test]
fn a_python_program_as_the_motor_is_identified_and_follows() {
    let door = Door::Exec(python_motor());
    let run = |tasks: &[Task]| {
        let wire = session::connect(&door, &config(), 1, &qemu()).expect("a motor");
        session::run(wire, config(), 1, tasks, &mut |_| {}).expect("a session")
    };
    let result = run(&[COMMISSION, sine(4.0)]);
    let [Done::Commissioned(outcome), Done::Tracked(span)] = &result.done[..] else {
        panic!("{:?}", result.done);
    };
    let report = CommissionJson::new(outcome, &config()).expect("a report");
    assert_eq!(report.refused, None);
    for dead_zone in [report.found.dead_zone_pos_v, report.found.dead_zone_neg_v] {
        assert!((dead_zone.value.expect("seen") - 1.0).abs() < 0.02, "{dead_zone:?}");
        assert!(dead_zone.trusted, "{dead_zone:?}");
    }
    for saturation in [report.found.saturation_pos_v, report.found.saturation_neg_v] {
        assert!((saturation.value.expect("seen") - 9.5).abs() < 0.1, "{saturation:?}");
    }
    let with = TrackJson::new(&result.log, span);

    // The result, saved and read again, serves a second session without the compensation.
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("params.toml");
    Params::new(report.mechanism, &report.found).save(&path).expect("a file");
    let estimates = Params::read(&path).expect("the file").estimates(&config());
    let Task::Track { profile, .. } = sine(4.0) else { unreachable!() };
    let track = Task::Track { profile, compensation: false };
    let second = run(&[Task::Adopt(Box::new(estimates)), track]);
    let Some(Done::Tracked(span)) = second.done.last() else {
        panic!("{:?}", second.done);
    };
    let without = TrackJson::new(&second.log, span);
    assert_eq!((with.faulted, without.faulted), (false, false));
    assert_eq!(with.used_parameters.gain, Source::Trusted);
    assert!(
        with.position_rms_rad < without.position_rms_rad / 3.0,
        "{} with, {} without compensation",
        with.position_rms_rad,
        without.position_rms_rad
    );
}

/// At 1.4 times what the commissioning finds to be left: before the axis is armed for it, or scaled.
#[test]
fn a_profile_that_takes_too_much_voltage_is_refused_or_scaled_with_the_number() {
    let run = |tasks: &[Task]| {
        let wire = session::connect(&Door::Exec(python_motor()), &config(), 1, &qemu()).expect("a motor");
        session::run(wire, config(), 1, tasks, &mut |_| {})
    };
    let motion = |profile: Profile| Task::Track { profile, compensation: true };
    let fast = motion(Profile::Sine { amplitude_rad: 33.0, frequency_hz: 1.0, seconds: 4.0 });
    let learned = run(&[COMMISSION]).expect("a session");
    let [Done::Commissioned(outcome)] = &learned.done[..] else {
        panic!("{:?}", learned.done);
    };
    let known = Task::Adopt(Box::new(outcome.estimates));
    let Err(error) = run(&[known.clone(), fast.clone()]) else {
        panic!("it is not refused");
    };
    let error = error.to_string();
    assert!(error.contains("V beyond the dead zone and") && error.contains("choose at most"), "{error}");

    let turns = (0..=200).map(|row| f64::from(row) * 0.02);
    let points = turns.map(|time_s| Waypoint {
        time_s,
        theta_rad: 33.0 * (std::f64::consts::TAU * time_s).sin(),
        ..Waypoint::default()
    });
    for too_much in [fast, motion(Profile::Points(points.collect()))] {
        let result = run(&[known.clone(), Task::Fit, too_much]).expect("it is scaled");
        let fitted = result.fitted.expect("scaled");
        let Some(Done::Tracked(span)) = result.done.last() else {
            panic!("{:?}", result.done);
        };
        let report = TrackJson::new(&result.log, span);
        println!("{}, limited {}", fitted.fitted_text(), report.saturated_share);
        assert!(report.saturated_share < 0.2 && !report.faulted, "{report:?}");
    }
}

#[test]
fn a_capture_holds_every_tick_around_its_event() {
    let door = Door::Exec(python_motor());
    let wire = session::connect(&door, &config(), 1, &qemu()).expect("a motor");
    let before = 300;
    let capture = Task::Capture { trigger: Trigger::Activity(Activity::Tracking), before };
    let result =
        session::run(wire, config(), 1, &[COMMISSION, capture, sine(2.0)], &mut |_| {}).expect("a session");
    let captured = result.captured.expect("a capture");
    assert_eq!(captured.stage, Stage::Done);
    assert_eq!(captured.shots.len(), LENGTH);
    // Telemetry at full rate is there to compare with: not one tick is missing or changed.
    let event = result
        .log
        .rows
        .iter()
        .position(|row| row.tick == captured.extent.trigger_tick)
        .expect("the event's row");
    assert_eq!(result.log.rows[event].record.activity, Activity::Tracking);
    assert_ne!(result.log.rows[event - 1].record.activity, Activity::Tracking);
    assert_eq!(captured.extent.trigger_index, before);
    let first = event - usize::from(before);
    for (shot, row) in captured.shots.iter().zip(&result.log.rows[first..]) {
        assert_eq!(*shot, Shot::from(&row.record), "tick {}", row.tick);
    }
}

/// Runs a command line as a user would; the error, in one line.
fn refused(arguments: &[&str]) -> String {
    let cli = Cli::try_parse_from([&["truing"], arguments].concat()).expect("a known command line");
    let error = cli.run().expect_err("this cannot work");
    format!("{error:#}")
}

#[test]
fn a_motor_that_dies_is_named_and_earlier_files_stay() {
    let folder = tempfile::tempdir().expect("a folder");
    let (axis, json) = (folder.path().join("axis.toml"), folder.path().join("result.json"));
    std::fs::write(&axis, AXIS).expect("a file");
    std::fs::write(&json, "earlier").expect("a file");
    let image = qemu().image;
    let error = refused(&[
        "commission",
        "--motor",
        "exec:exec python3 -c 'import sys\nfor _ in range(100): sys.stdin.buffer.read(16); sys.stdout.buffer.write(bytes(10) + b\"\\x40\\x41\" + bytes(4)); sys.stdout.flush()\nsys.exit(3)'",
        "--image",
        &image.display().to_string(),
        "--config",
        &axis.display().to_string(),
        "--json",
        &json.display().to_string(),
    ]);
    assert!(error.contains("exit status: 3 at tick 100") && error.contains("16-byte"), "{error}");
    assert_eq!(std::fs::read_to_string(&json).expect("still there"), "earlier");
}

#[test]
fn a_motor_that_answers_late_is_given_up() {
    let mut motor = Exec::start("exec sleep 60").expect("sh");
    let drive = Drive { tick: 7, duty: 0.0, bridge: servo::axis::Bridge::Open, tick_s: 1e-3 };
    let begin = std::time::Instant::now();
    let error = motor.pass(&drive).expect_err("no answer").to_string();
    let waited = begin.elapsed().as_secs_f64();
    assert!((9.5..15.0).contains(&waited), "{waited} s");
    assert!(error.contains("tick 7") && error.contains("10 s"), "{error}");
}

#[test]
fn what_is_missing_is_named_with_its_remedy() {
    let without_qemu = QemuOptions { program: "/nonexistent/qemu-system-arm".into(), ..qemu() };
    let error = Qemu::start(&without_qemu).err().expect("no QEMU").to_string();
    assert!(error.contains("apt install qemu-system-arm"), "{error}");

    let without_image = QemuOptions { image: "/nonexistent/qemu.elf".into(), ..qemu() };
    let error = Qemu::start(&without_image).err().expect("no image").to_string();
    assert!(error.contains("cargo xtask images") && error.contains("/nonexistent/qemu.elf"), "{error}");

    let folder = tempfile::tempdir().expect("a folder");
    let broken = folder.path().join("broken.elf");
    std::fs::write(&broken, "not an image").expect("a file");
    let not_an_image = QemuOptions { image: broken, ..qemu() };
    let error =
        Qemu::start(&not_an_image).and_then(|mut qemu| qemu.listen()).expect_err("no image").to_string();
    assert!(error.contains("cargo xtask images"), "{error}");
}

#[test]
fn no_qemu_outlives_its_session() {
    let mut running = Qemu::start(&qemu()).expect("QEMU");
    running.listen().expect("a first word");
    let process = Path::new("/proc").join(running.process().to_string());
    assert!(process.exists());
    drop(running);
    assert!(!process.exists());
}

#[test]
fn a_bad_axis_file_is_named_by_line_and_field() {
    let cases = [
        (AXIS.replace("tick_hz = 1000", "tick_hz = 100"), "axis.tick_hz"),
        (AXIS.replace("rated_speed_rad_s", "rated_sped_rad_s"), "rated_sped_rad_s"),
        (AXIS.replace("2048", "\"many\""), "line 5"),
        (AXIS.replace("nominal_v = 12.0", "nominal_v = nan"), "supply.nominal_v"),
        (AXIS.replace("[encoder]\n    counts_per_rev = 2048", ""), "encoder"),
    ];
    for (text, expected) in cases {
        let error = axis_file::parse("axis.toml", &text).expect_err(expected).to_string();
        assert!(error.starts_with("axis.toml") && error.contains(expected), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn a_bad_profile_is_refused_before_anything_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let axis = folder.path().join("axis.toml");
    std::fs::write(&axis, AXIS).expect("a file");
    let points = folder.path().join("points.csv");
    std::fs::write(&points, "t_s,theta_ref_rad\n0,0\n1,0.5\n1,0.7\n").expect("a file");
    let file = format!("file:{}", points.display());
    for (profile, expected) in [
        ("sine:1,2", "sine:amp_rad,hz,seconds"),
        ("triangle:1,2,3", "sine:amp_rad,hz,seconds"),
        ("step:1,-4", "0.01 to 3600"),
        ("sine:10,50,2", "choose at most"),
        (file.as_str(), "line 4"),
    ] {
        let axis = axis.display().to_string();
        let arguments = ["track", "--motor", "exec:true", "--config", &axis, "--profile", profile];
        let error = refused(&arguments);
        assert!(error.contains(expected), "{error}");
    }
}

/// The count rises whichever way the shaft turns: the chip ends it by itself, and says which wire to look at.
#[test]
fn a_missing_channel_ends_the_commissioning_on_the_chip() {
    let plant = Plant::draw(Family::G2, Severity::Nominal, Seeds::Evaluation(400_020), &Options::default());
    let motor = FlawedMotor::new(&plant, Flaw::CountsUp(0.0));
    let shown = motor.shown();
    let wire = Lockstep::start(&qemu(), Box::new(motor), plant.config).expect("QEMU");
    let result =
        session::run(Box::new(wire), plant.config, 1, &[COMMISSION], &mut |_| {}).expect("a session");
    let [Done::Commissioned(outcome)] = &result.done[..] else {
        panic!("{:?}", result.done);
    };
    let refused = CommissionJson::new(outcome, &plant.config).expect("a report").refused.expect("a refusal");
    assert_eq!(refused.code, "channel_missing", "{refused:?}");
    assert!(refused.text.contains("A and B"), "{refused:?}");
    let shown = *shown.lock().expect("nobody panics with it");
    assert!(shown.since_s.is_some() && shown.is_soon_over(), "{shown:?}");
}

#[test]
fn a_motor_that_does_not_turn_is_refused_with_advice() {
    // Answers every frame with zeros, the current too: nothing is connected.
    let still = "exec python3 -c 'import sys\nwhile len(sys.stdin.buffer.read(16)) == 16:\n sys.stdout.buffer.write(bytes(8) + b\"\\x00\\x00\\x40\\x41\" + bytes(4)); sys.stdout.flush()'";
    let wire = session::connect(&Door::Exec(still.into()), &config(), 1, &qemu()).expect("a motor");
    let result = session::run(wire, config(), 1, &[COMMISSION], &mut |_| {}).expect("a session");
    let [Done::Commissioned(outcome)] = &result.done[..] else {
        panic!("{:?}", result.done);
    };
    let refused = CommissionJson::new(outcome, &config()).expect("a report").refused.expect("a refusal");
    assert_eq!(refused.code, "motor_disconnected", "{refused:?}");
    assert!(refused.text.contains("leads"), "{refused:?}");
    // All switches are off at the end.
    assert_eq!(result.log.rows.last().expect("rows").record.bridge, servo::axis::Bridge::Open);
}
