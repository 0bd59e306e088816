//! A chirp from the command line through the image in QEMU: the same bits, and a log that `truing gap` reads.

use serde_json::Value;
use servo::motion::excitation::{Sweep, Waveform};
use servo::record::Activity;
use std::path::Path;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::firmware::{compare, qemu, truing};
use truing::device::session::{Done, Task};

#[test]
fn chip_and_host_excite_with_the_same_bits() {
    for (tick_hz, sweep) in [(1_000, Sweep::Logarithmic), (10_000, Sweep::Linear)] {
        let options = Options { tick_hz, ..Options::default() };
        let plant = Plant::draw(Family::G2, Severity::Harsh, Seeds::Evaluation(761_000), &options);
        let chirp =
            Task::Excite(Waveform { amplitude_v: 7.0, from_hz: 0.4, to_hz: 30.0, sweep, duration_ms: 3_000 });
        let (result, verdict) = compare(&plant, &[chirp]).expect("a session");
        assert!(verdict.identical(), "{tick_hz} Hz: {verdict}");
        let Some(Done::Excited(span, _)) = result.done.last() else {
            panic!("{:?}", result.done);
        };
        assert!(!span.faulted);
        let driving = |row: &&truing::device::run_log::Row| row.record.activity == Activity::Driving;
        assert_eq!(result.log.rows.iter().filter(driving).count(), 3 * tick_hz as usize);
    }
}

/// A 12 V motor with 64 ms and 200 rad/s; `known`: what it has besides.
fn model(known: &str) -> String {
    format!(
        "schema = \"truing-model/1\"\n[motor]\nR_ohm = 2.0\nL_h = 0.002\nKt_nm_per_a = 0.055\nKe_vs_per_rad = 0.055\n\
         J_kgm2 = 1.0e-4\nb_nms_per_rad = 5e-5\n[supply]\nnominal_v = 12.0\n[encoder]\ncounts_per_rev = 4096\n{known}"
    )
}

const AXIS: &str = "[supply]\nnominal_v = 12.0\n[encoder]\ncounts_per_rev = 4096\n[axis]\nrated_speed_rad_s = 210.0\ntick_hz = 1000\n";

fn file(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a file");
    path.display().to_string()
}

fn said(arguments: &[&str]) -> Result<String, String> {
    let output = truing().args(arguments).output().expect("the program runs");
    let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if output.status.success() { Ok(words(&output.stdout)) } else { Err(words(&output.stderr)) }
}

#[test]
fn a_chirp_is_recorded_and_its_gap_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let motor = file(folder, "motor.toml", &model("[known.coulomb_friction]\nlevel_nm = 0.033\n"));
    let nominal = file(folder, "nominal.toml", &model(""));
    let axis = file(folder, "axis.toml", AXIS);
    let place = |name: &str| folder.join(name).display().to_string();
    let (log, track, gap) = (place("run.csv"), place("track.json"), place("gap.json"));
    let image = qemu().image.display().to_string();
    let door = format!("builtin:{motor}");
    let on = ["track", "--motor", &door, "--config", &axis, "--image", &image, "--profile"];
    let words =
        said(&[&on[..], &["chirp:8,0.4,3,8", "--json", &track, "--log", &log]].concat()).expect("a run");
    assert!(words.contains("dead zone, positive"), "{words}");
    let json = |path: &str| -> Value {
        serde_json::from_str(&std::fs::read_to_string(path).expect("a file")).expect("JSON")
    };
    let result = json(&track);
    assert_eq!(result["schema"], "truing-track/1");
    assert_eq!(result["position_rms_rad"], Value::Null);
    assert_eq!(result["faulted"], false);
    // 0.033 Nm at 0.055 Nm/A and 2 Ω.
    let dead_zone = result["learned"]["dead_zone_pos_v"]["value"].as_f64().expect("a value");
    assert!((dead_zone - 1.2).abs() < 0.05, "{result}");

    said(&["gap", "--model", &nominal, "--log", &log, "--json", &gap]).expect("an analysis");
    let outcome = json(&gap);
    let names: Vec<&str> = outcome["effects"]
        .as_array()
        .expect("effects")
        .iter()
        .filter_map(|effect| effect["name"].as_str())
        .collect();
    assert_eq!(names, ["coulomb_friction"], "{outcome}");

    // What cannot be is refused before anything runs, with its name and range.
    for (profile, expected) in [
        ("chirp:13,0.4,3,8", "excitation.amplitude_v must lie between 0.012 and 12"),
        ("chirp:8,0.4,51,8", "excitation.to_hz must lie between 0.01 and 50"),
        ("log_chirp:8,0,30,8", "excitation.from_hz must lie between 0.01 and 50"),
        ("voltage_sine:8,2,0.05", "excitation.duration_s must lie between 0.1 and 3600"),
        ("voltage_sine:8,2", "voltage_sine:amp_v,hz,seconds"),
    ] {
        let error = said(&[&on[..], &[profile]].concat()).expect_err("a refusal");
        assert!(error.contains(expected), "{error}");
    }
}
