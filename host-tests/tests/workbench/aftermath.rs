//! What the log tells about a fault beyond its name.

use servo::axis::Bridge;
use servo::config::Config;
use servo::link::protocol::Command;
use servo::protect::Fault;
use servo::record::Record;
use truing::device::aftermath::fault_text;
use truing::device::commission_report::Params;
use truing::device::run_log::{Row, RunLog};

const CONFIG: Config = Config { tick_hz: 1_000, ..Config::EXAMPLE };

/// Half a second at `before` counts a tick, a fault, and half a second at `after` with the bridge open; `current` per tick of motion.
fn log(fault: Fault, before: i32, after: i32, current: i16) -> RunLog {
    let mut log = RunLog::new(CONFIG);
    log.commands.push((0, Command::Arm));
    let mut count = 0;
    for tick in 0..1_000u32 {
        let driven = tick < 500;
        count += if driven { before } else { after };
        let record = Record {
            tick,
            count,
            duty: if driven { 1_000 } else { 0 },
            bridge: if driven { Bridge::Driven } else { Bridge::Open },
            current_raw: if driven { current } else { 0 },
            fault: if driven { Fault::None } else { fault },
            ..Record::default()
        };
        log.rows.push(Row { tick, cost: 0, motor_flags: 0, record });
    }
    log
}

#[track_caller]
fn says(log: &RunLog, words: &[&str], not: &[&str]) {
    let text = fault_text(log);
    assert!(words.iter().all(|word| text.contains(word)), "{text}");
    assert!(not.iter().all(|word| !text.contains(word)), "{text}");
}

#[test]
fn a_shaft_that_speeds_up_with_the_bridge_open_is_said_so_and_wiring_that_worked_is_not_blamed() {
    says(&log(Fault::WrongDirection, 5, 15, 100), &["switch the motor's supply off", "shorted"], &["swap"]);
    says(
        &log(Fault::WrongDirection, 5, 3, 100),
        &["followed before"],
        &["swap", "switch the motor's supply off"],
    );
    says(&log(Fault::WrongDirection, -5, -3, 100), &["swap"], &["followed"]);
    says(&log(Fault::Runaway, 5, 3, 100), &["(fault 17, runaway)"], &[]);
}

#[test]
fn a_current_sensor_that_reads_backwards_or_nothing_is_named_and_not_the_encoder() {
    says(&log(Fault::SlippingCounts, 5, 3, -100), &["backwards", "current sensor"], &["encoder"]);
    says(&log(Fault::MotorDisconnected, 5, 3, 0), &["check the current sensor"], &["brushes"]);
    says(&log(Fault::MotorDisconnected, 0, 0, 0), &["brushes"], &["sensor"]);
    says(&log(Fault::SlippingCounts, 5, 3, 100), &["encoder", "(fault 10, slipping_counts)"], &["current"]);
}

/// Behind the fault that ended a motion the host's own stop clears it, and another one may follow.
#[test]
fn the_fault_that_ended_the_motion_is_told_and_not_what_followed() {
    let mut log = log(Fault::WrongDirection, 5, 3, 100);
    log.rows[700..].iter_mut().for_each(|row| row.record.fault = Fault::None);
    log.rows[800..].iter_mut().for_each(|row| row.record.fault = Fault::Runaway);
    assert_eq!(log.fault(), Fault::WrongDirection);
}

#[test]
fn a_parameter_file_without_a_number_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("params.toml");
    Params::nothing().save(&path).expect("written");
    let error = Params::read(&path).expect_err("it holds nothing").to_string();
    assert!(error.contains("commission again"), "{error}");
}
