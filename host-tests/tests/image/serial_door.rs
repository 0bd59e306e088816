//! `serial:PORT`, end to end: the command line on one end of a pseudo terminal, the image in QEMU on the other, in real time.

use servo::axis::Bridge;
use servo::link::protocol::Command as Order;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;
use trials::exec_bench::send;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::firmware::truing;
use trials::serial_line::SerialServo;
use truing::device::axis_file;
use truing::device::run_log::Tape;

fn plant() -> Plant {
    Plant::draw(Family::G1, Severity::Nominal, Seeds::Evaluation(400_021), &Options::default())
}

/// The axis file of this plant.
fn axis_file(folder: &Path, plant: &Plant) -> String {
    let config = &plant.config;
    let path = folder.join("axis.toml");
    let text = format!(
        "[supply]\nnominal_v = {:?}\nvbus_v_per_lsb = {:?}\n[encoder]\ncounts_per_rev = {}\n[axis]\nrated_speed_rad_s = {:?}\n\
         tick_hz = {}\ngear_ratio = {:?}\npwm_full_scale = {}\n[limits]\ncurrent_a_per_lsb = {:?}\n",
        config.supply_nominal_v,
        config.vbus_v_per_lsb,
        config.counts_per_rev,
        config.rated_speed_rad_s,
        config.tick_hz,
        config.gear_ratio,
        config.pwm_full_scale,
        config.current_a_per_lsb,
    );
    std::fs::write(&path, text).expect("a file");
    path.display().to_string()
}

/// Runs `truing` as a user would; what it says.
fn said(arguments: &[&str]) -> String {
    let output = truing().args(arguments).output().expect("the program runs");
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{arguments:?}: {words}{}", String::from_utf8_lossy(&output.stderr));
    words
}

/// One servo, one line, one command after another, as at a bench.
#[test]
fn a_servo_on_a_serial_line_is_commissioned_stored_changed_captured_and_watched() {
    let folder = tempfile::tempdir().expect("a folder");
    let flash = folder.path().join("flash.bin");
    let plant = plant();
    let axis = axis_file(folder.path(), &plant);
    let file = |name: &str| folder.path().join(name).display().to_string();
    let (json, csv) = (file("commission.json"), file("capture.csv"));
    let servo = SerialServo::start(&plant, Some(flash.clone()));
    let door = servo.door();
    let on = ["--motor", door.as_str(), "--config", axis.as_str()];
    let with = |head: &[&'static str], tail: &[&str]| -> String {
        let owned: Vec<String> = head.iter().chain(&on).chain(tail).map(|word| (*word).to_owned()).collect();
        said(&owned.iter().map(String::as_str).collect::<Vec<_>>())
    };

    let told = with(&["commission"], &["--budget-s", "4", "--store", "--json", &json]);
    assert!(told.contains("stored"), "{told}");
    let report: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).expect("a report")).expect("JSON");
    let dead_zone = report["dead_zone_pos_v"]["value"].as_f64().expect("a number");
    let error = dead_zone / plant.truth.dead_zone_v[0] - 1.0;
    assert!(error.abs() < 0.05, "{:.1} % off", 100.0 * error);

    let told = with(&["monitor"], &["--board"]);
    assert!(told.contains("board         qemu\n") && told.contains("as the axis file says"), "{told}");

    let told = with(&["params", "get"], &[]);
    assert!(told.contains("stored") || told.contains("nothing is stored"), "{told}");
    assert!(told.contains("identified.dead_zone_pos_v = "), "{told}");
    with(&["params", "set"], &["loops.bandwidth=1.5", "--save"]);

    let told = with(&["capture"], &["--stored", "--profile", "step:1.0,1", "--before", "100", "--out", &csv]);
    assert!(told.contains("1024 control ticks"), "{told}");
    let rows = std::fs::read_to_string(&csv).expect("a capture").lines().count();
    assert_eq!(rows, 1025);

    let told = with(&["monitor"], &["--stored", "--profile", "sine:1.0,1,2"]);
    for word in ["set-point", "position", "speed", "voltage", "limit none", "fault none", "gain stored"] {
        assert!(told.contains(word), "no {word} in {told}");
    }
    drop(servo);

    // Power off and on again.
    let servo = SerialServo::start(&plant, Some(flash));
    let door = servo.door();
    let told = said(&["params", "get", "--motor", &door, "--config", &axis]);
    assert!(
        told.contains("stored parameters are in force") && told.contains("loops.bandwidth = 1.5"),
        "{told}"
    );
}

/// Nobody else would stop the motor at the other end of a real line.
#[test]
fn ctrl_c_stops_a_servo_on_a_serial_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let plant = plant();
    let axis = axis_file(folder.path(), &plant);
    let log = folder.path().join("run.csv");
    let servo = SerialServo::start(&plant, None);
    let child = Command::new("env")
        .arg("--default-signal=INT")
        .arg(truing().get_program())
        .args(["commission", "--motor", &servo.door(), "--config", &axis, "--log"])
        .arg(&log)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    // Real time: the commissioning of 5 s has begun.
    std::thread::sleep(Duration::from_millis(2500));
    send("INT", &child);
    let output = child.wait_with_output().expect("its end");
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    let config = axis_file::read(Path::new(&axis)).expect("the axis").config;
    let tape = Tape::read(&log, &config).expect("a log that can be read");
    assert!(matches!(tape.commands.last(), Some((_, Order::Stop))));
    assert!(tape.traces.iter().any(|trace| trace.bridge == Bridge::Driven));
    assert_eq!(tape.traces.last().expect("a row").bridge, Bridge::Open);
}
