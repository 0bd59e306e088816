//! `truing look` as a stranger calls it: 80 columns, a line to copy, JSON on standard output, no accusation of a right file.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn look(file: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_truing")).arg("look").arg(file).args(more).output().unwrap()
}

fn json(file: &Path, more: &[&str]) -> Value {
    let output = look(file, &[&["--json", "-"], more].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The logs of the measured rigs of this repository.
fn rigs() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/rigs");
    let logs = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path().join("log.csv"));
    logs.filter(|log| log.exists()).collect()
}

/// A motor of 80 ms that answers `late` rows late.
fn turned(late: usize) -> String {
    let u = |k: usize| if k * k % 37 < 18 { 255 } else { -100 };
    let mut omega = 0.0;
    let row = |k: usize| {
        let line = format!("{},{},{omega:.1}\n", 5 * k, u(k / 9));
        omega += (8.0 * f64::from(u(k.saturating_sub(late) / 9)) - omega) * 5.0 / 80.0;
        line
    };
    format!("millis,pwm,rpm\n{}", (0..900).map(row).collect::<String>())
}

#[test]
fn a_log_is_shown_in_80_columns_with_a_line_to_copy() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, turned(0)).unwrap();
    let output = look(&path, &[]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0));
    assert!(said.contains("--columns \"duty=pwm/255,vbus_v=12\""), "{said}");
    for word in ["t_ms", "omega_rpm", "200 rows a second", "in the next row", "Log the supply voltage"] {
        assert!(said.contains(word), "`{word}` is not in:\n{said}");
    }
    let dots = said.chars().filter(|letter| ('\u{2801}'..='\u{28ff}').contains(letter)).count();
    assert!(dots > 100, "two plots of braille dots:\n{said}");
    let long = said
        .lines()
        .find(|line| line.chars().count() > 80 && !line.starts_with("Add") && !line.contains('/'));
    assert_eq!(long, None);
}

#[test]
fn a_delay_is_seen_between_input_and_output() {
    let folder = tempfile::tempdir().unwrap();
    for late in [0, 1, 3, 10] {
        let path = folder.path().join("log.csv");
        std::fs::write(&path, turned(late)).unwrap();
        let answer = &json(&path, &[])["answer"];
        assert_eq!(answer["rows"], 1 + late, "{answer}");
        assert!((answer["delay_s"].as_f64().unwrap() - 0.005 * late as f64).abs() < 1e-6, "{answer}");
    }
}

#[test]
fn json_goes_to_standard_output_alone_and_its_line_works() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, turned(0)).unwrap();
    let first = json(&path, &[]);
    assert_eq!(first["schema"], "truing-look/1");
    assert_eq!(first["columns"][1]["state"], "proposed");
    let second = json(&path, &["--columns", first["columns_argument"].as_str().unwrap()]);
    assert_eq!(second["columns_argument"], "");
    assert_eq!(second["refused"], Value::Null);
    assert_eq!(second["columns"][1]["state"], "read");
    assert!(!Path::new("-").exists());
}

#[test]
fn a_file_that_cannot_be_read_is_refused_and_one_without_an_output_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(look(&folder.path().join("none.csv"), &[]).status.code(), Some(2));
    let path = folder.path().join("log.csv");
    std::fs::write(&path, turned(0).replace("rpm", "note")).unwrap();
    let output = look(&path, &[]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(2));
    assert!(said.contains("Refused") && said.contains("for the speed or the"), "{said}");
    assert_eq!(look(&path, &["--json", path.to_str().unwrap()]).status.code(), Some(2));
}

#[test]
fn measured_rigs_are_read_as_they_are_and_not_accused() {
    let rigs = rigs();
    assert!(rigs.len() >= 10, "{}", rigs.len());
    for rig in rigs {
        let seen = json(&rig, &[]);
        assert_eq!(seen["refused"], Value::Null, "{}", rig.display());
        assert_eq!(seen["columns_argument"], "", "{}", rig.display());
        let asked = seen["ask"].to_string();
        for accusation in ["turn one sign", "visibly follow"] {
            assert!(!asked.contains(accusation), "{}: {asked}", rig.display());
        }
    }
}
