//! What a servo has found or recorded is on the screen and in the files, however the session ends; and the exit status
//! says whether it did what it was asked for.

use std::path::Path;
use trials::exec_bench::ExecBench;
use truing::device::axis_file;
use truing::device::run_log::Tape;

/// Comes to rest within a moment.
const MOTOR: &str = "0.2";

/// The log as the replay reads it.
fn tape(path: &Path) -> Tape {
    let config = axis_file::read(&path.with_file_name("axis.toml")).expect("the axis").config;
    Tape::read(path, &config).expect("a log that can be read")
}

#[test]
fn an_axis_that_coasts_for_minutes_is_commissioned_braked_and_stored() {
    let bench = ExecBench::default();
    let outputs = ["--save", "params.toml", "--json", "out.json", "--log", "run.csv"];
    let said = bench.run(&[&["commission", "--store", "--budget-s", "4"], &outputs[..]].concat(), "300");
    assert_eq!(said.status, Some(0), "{said:?}");
    assert!(said.out.contains("dead zone, positive"), "{said:?}");
    assert!(said.out.ends_with("stored                by the servo\n"), "{said:?}");
    assert!(bench.text("params.toml").contains("dead_zone_pos_v"));
    assert!(bench.text("out.json").contains("\"refused\": null"));
    assert!(!tape(&bench.path("run.csv")).traces.is_empty());
}

#[test]
fn what_was_found_before_the_motor_died_while_storing_is_kept() {
    let bench = ExecBench::default();
    let outputs = ["--save", "params.toml", "--json", "out.json", "--log", "run.csv"];
    // A commissioning of 2 s ends before tick 3,500, and the shaft coasts on.
    let said =
        bench.run(&[&["commission", "--store", "--budget-s", "2"], &outputs[..]].concat(), "300 3500 die");
    assert_eq!(said.status, Some(2), "{said:?}");
    assert!(said.err.contains("exit status: 3"), "{said:?}");
    assert!(said.out.contains("dead zone, positive"), "{said:?}");
    assert!(bench.text("params.toml").contains("dead_zone_pos_v"));
    assert!(bench.text("out.json").contains("\"refused\": null"));
    assert!(tape(&bench.path("run.csv")).traces.len() > 3000);
}

#[test]
fn a_refused_commissioning_says_why_first_and_exits_with_1() {
    let bench = ExecBench::default();
    let said = bench.run(&["commission", "--json", "out.json"], "0.2 0 jam");
    assert_eq!(said.status, Some(1), "{said:?}");
    let first = said.out.lines().next().expect("a line");
    assert!(first.starts_with("refused: voltage was applied and nothing moved"), "{said:?}");
    assert!(said.err.contains("nothing moved: free the shaft"), "{said:?}");
    assert!(bench.text("out.json").contains("no_motion"));
}

#[test]
fn a_track_that_a_fault_ends_says_so_first_and_exits_with_1() {
    // Without a commissioning before it, and with one, which ends before tick 6,000.
    for (profile, motor) in [("voltage_sine:6,1,3", "0.2 600 nan"), ("sine:1,0.5,9", "0.2 8000 nan")] {
        let bench = ExecBench::default();
        let outputs = ["--log", "run.csv", "--json", "out.json"];
        let said = bench.run(&[&["track", "--profile", profile], &outputs[..]].concat(), motor);
        assert_eq!(said.status, Some(1), "{said:?}");
        let first = said.out.lines().next().expect("a line");
        let reason = "a fault ended the motion: the supply was measured and is not any more";
        assert!(first.starts_with(reason), "{said:?}");
        assert!(bench.text("out.json").contains("\"faulted\": true"));
        assert!(!tape(&bench.path("run.csv")).traces.is_empty());
    }
}

/// The mark is looked for before and behind the motion.
#[test]
fn counts_that_are_lost_on_the_way_are_told_by_an_end_stop() {
    for command in ["track", "monitor"] {
        let words = [command, "--profile", "step:30,2", "--reference", "stop:-8,0,40", "--check"];
        let fast: &[&str] = if command == "monitor" { &["--fast"] } else { &[] };
        let said = |motor: &str| ExecBench::default().run(&[&words, fast].concat(), motor);
        let well = said("0.2 9000 wall");
        assert_eq!(well.status, Some(0), "{well:?}");
        assert!(well.out.contains("by the mark that was found before and behind the motion"), "{well:?}");
        let badly = said("0.2 9000 lose");
        assert_eq!(badly.status, Some(1), "{badly:?}");
        let told = format!("{}{}", badly.out, badly.err);
        assert!(
            told.contains("counts were lost or invented during the motion: check the encoder's"),
            "{badly:?}"
        );
    }
}

#[test]
fn a_commissioning_that_a_fault_ends_names_the_fault() {
    let bench = ExecBench::default();
    let said = bench.run(&["commission", "--log", "run.csv"], "0.2 1500 nan");
    assert_eq!(said.status, Some(1), "{said:?}");
    let first = said.out.lines().next().expect("a line");
    assert!(first.contains("the supply was measured and is not any more"), "{said:?}");
    assert!(!first.contains("run it again"), "{said:?}");
}

#[test]
fn the_log_up_to_the_death_of_the_motor_is_written() {
    let bench = ExecBench::default();
    let said = bench.run(&["track", "--profile", "voltage_sine:6,1,3", "--log", "run.csv"], "0.2 1000 die");
    assert_eq!(said.status, Some(2), "{said:?}");
    assert!(said.err.contains("exit status: 3 at tick 1000"), "{said:?}");
    let last = tape(&bench.path("run.csv")).traces.last().expect("a row").tick;
    assert!((900..=1000).contains(&last), "{last}");
    bench.assert_clean();
}

#[test]
fn text_in_place_of_frames_is_quoted_with_its_tick() {
    let bench = ExecBench::default();
    let said = bench.run(&["commission"], "0.2 1000 text");
    assert_eq!(said.status, Some(2), "{said:?}");
    assert!(said.err.contains("tick 1000 with the text `model loaded...\\n`"), "{said:?}");
    assert!(!said.err.contains("supply rose"), "{said:?}");
}

#[test]
fn places_that_take_no_file_are_refused_before_a_motor_starts() {
    let sine = ["--profile", "voltage_sine:3,1,1"];
    let commands: [(&[&str], &str); 6] = [
        (&["commission"], "--save"),
        (&["commission"], "--json"),
        (&["commission"], "--log"),
        (&["track", sine[0], sine[1]], "--json"),
        (&["move", "--by", "1"], "--log"),
        (&["capture", sine[0], sine[1]], "--out"),
    ];
    for (command, output) in commands {
        for (place, word) in [("no/such/file", "make it first"), ("tmp", "name another one")] {
            let bench = ExecBench::default();
            let said = bench.run(&[command, &[output, place]].concat(), MOTOR);
            assert_eq!(said.status, Some(2), "{said:?}");
            assert!(said.err.contains(output) && said.err.contains(word), "{said:?}");
            assert!(!bench.path("motor.pid").exists(), "{command:?} {output}");
        }
    }
}

#[test]
fn an_event_that_does_not_come_exits_with_1() {
    let bench = ExecBench::default();
    let said = bench.run(
        &["capture", "--profile", "voltage_sine:3,1,1", "--trigger", "fault", "--out", "capture.csv"],
        MOTOR,
    );
    assert_eq!(said.status, Some(1), "{said:?}");
    assert!(said.err.contains("the event has not come"), "{said:?}");
    assert!(bench.text("capture.csv").lines().count() > 1000);
}

#[test]
fn a_capture_cannot_begin_earlier_than_it_is_long() {
    let bench = ExecBench::default();
    let sine = ["capture", "--profile", "voltage_sine:3,1,1", "--out", "capture.csv"];
    let said = bench.run(&[&sine[..], &["--before", "1024"]].concat(), MOTOR);
    assert_eq!(said.status, Some(2), "{said:?}");
    assert!(said.err.contains("1023"), "{said:?}");
    assert!(!bench.path("motor.pid").exists());
}
