//! Ctrl-C, a termination and a hang-up while a motor moves: the servo is stopped, what was recorded is written, nothing
//! stays behind.

use servo::link::protocol::Command;
use std::time::{Duration, Instant};
use trials::exec_bench::{ExecBench, Said, send};
use truing::device::axis_file;
use truing::device::run_log::Tape;

/// An interrupted command has ended by then, whatever its motor does.
const PROMPT: Duration = Duration::from_secs(8);
/// Coasts for some seconds.
const MOTOR: &str = "2";

/// Starts the command and sends the signal when the motor is at this tick.
fn interrupted(bench: &ExecBench, command: &[&str], signal: &str, tick: u32) -> Said {
    let child = bench.command(command, MOTOR).spawn().expect("the program runs");
    bench.wait_for_tick(tick);
    send(signal, &child);
    let begin = Instant::now();
    let said = Said::from(child.wait_with_output().expect("its end"));
    assert!(begin.elapsed() < PROMPT, "{:?}", begin.elapsed());
    said
}

/// The motor has seen the bridge open, the log is whole up to the stop.
fn assert_stopped(bench: &ExecBench, said: &Said, log: Option<&str>) {
    assert_eq!(said.status, Some(130), "{said:?}");
    let stopped = "interrupted: the servo was stopped, its bridge is open";
    assert_eq!(said.err.trim(), stopped, "{said:?}");
    assert_eq!(bench.text("motor.end"), "bridge 0");
    bench.assert_clean();
    let Some(log) = log else { return };
    let config = axis_file::read(&bench.path("axis.toml")).expect("the axis").config;
    let tape = Tape::read(&bench.path(log), &config).expect("a log that can be read");
    assert!(matches!(tape.commands.last(), Some((_, Command::Stop))));
    let last = tape.traces.last().expect("a row");
    assert_eq!(last.bridge, servo::axis::Bridge::Open);
}

#[test]
fn every_signal_at_any_moment_of_a_commissioning_stops_the_servo() {
    for (signal, tick) in [("INT", 100), ("TERM", 1000), ("HUP", 4000), ("INT", 7000)] {
        let bench = ExecBench::default();
        let command = ["commission", "--budget-s", "60", "--log", "run.csv"];
        let said = interrupted(&bench, &command, signal, tick);
        assert_stopped(&bench, &said, (tick > 100).then_some("run.csv"));
    }
}

#[test]
fn every_command_that_moves_a_motor_is_stopped() {
    let sine = ["--profile", "voltage_sine:6,1,60"];
    let commands: [(&[&str], Option<&str>); 4] = [
        (&["track", sine[0], sine[1], "--log", "run.csv"], Some("run.csv")),
        (&["move", "--by", "1", "--budget-s", "60", "--log", "run.csv"], Some("run.csv")),
        (&["capture", sine[0], sine[1], "--out", "capture.csv"], None),
        (&["monitor", "--fast", sine[0], sine[1]], None),
    ];
    for (command, log) in commands {
        let bench = ExecBench::default();
        let said = interrupted(&bench, command, "TERM", 2000);
        assert_stopped(&bench, &said, log);
    }
}

/// The motor program neither answers nor ends.
#[test]
fn a_motor_that_hangs_keeps_nobody_alive() {
    for signals in [1, 2] {
        let bench = ExecBench::default();
        let command = ["commission", "--budget-s", "60", "--log", "run.csv"];
        let child = bench.command(&command, "2 1500 hang").spawn().expect("the program runs");
        bench.wait_for_file("motor.hangs");
        let begin = Instant::now();
        for signal in 0..signals {
            std::thread::sleep(Duration::from_millis(200 * signal));
            send("TERM", &child);
        }
        let said = Said::from(child.wait_with_output().expect("its end"));
        assert_eq!(said.status, Some(130), "{said:?}");
        assert!(begin.elapsed() < PROMPT, "{:?}", begin.elapsed());
        bench.assert_clean();
        // The second signal ends the program at once, without a log.
        if signals == 1 {
            assert!(said.err.contains("switch its supply off"), "{said:?}");
            assert!(bench.text("run.csv").lines().count() > 1000);
        }
    }
}
