//! Bad inputs to every command: what each answer must hold. The lists beside this file are data, so that a case is a few lines.
//!
//! A case changes the files of a good desk and runs a command line. Its answer is good if it ends with the stated exit status, says every
//! stated word (the file or option, the place, the remedy), does not panic, leaves every input as it was, and leaves no file behind.

use rayon::prelude::*;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use trials::firmware::{qemu, truing};

/// Lists, one a room.
const LISTS: &[(&str, &str)] = &[
    ("logs", include_str!("logs.toml")),
    ("columns", include_str!("columns.toml")),
    ("models", include_str!("models.toml")),
    ("options", include_str!("options.toml")),
    ("motors", include_str!("motors.toml")),
];
/// Fewest cases.
const FEWEST: usize = 200;
/// Share of them that must be answered well.
const WELL: f64 = 0.98;

#[derive(Deserialize)]
struct List {
    case: Vec<Case>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    /// The command line behind `truing`.
    run: String,
    /// A file's new text under its name; under `NAME:LINE` the new text of a line, under `NAME/TEXT` what stands in its place.
    #[serde(default)]
    with: BTreeMap<String, String>,
    /// What the answer must hold.
    says: Vec<String>,
    /// What it must not hold.
    #[serde(default)]
    never: Vec<String>,
    /// The exit status.
    #[serde(default = "unusable")]
    status: i32,
    /// Files that the command is to write all the same.
    #[serde(default)]
    writes: Vec<String>,
}

/// Exit status of an input that cannot be used.
fn unusable() -> i32 {
    2
}

const MODEL: &str = r#"schema = "truing-model/1"
[model]
kind = "dc_motor"
[motor]
R_ohm = 9.375
Kt_nm_per_a = 0.0625
J_kgm2 = 3.75e-5
[tolerance]
default = 0.05
[supply]
nominal_v = 12.0
"#;

const AXIS: &str =
    "[supply]\nnominal_v = 12.0\n[encoder]\ncounts_per_rev = 2048\n[axis]\nrated_speed_rad_s = 190.0\n";

/// Rows of a motor of 16 rad/s per volt and 90 ms, every 10 ms, behind the header: the model above lacks nothing.
fn record(seed: u32) -> String {
    const LEVELS: [f64; 8] = [0.0, 10.0, -6.0, 3.0, -10.0, 5.0, -3.0, 8.0];
    let (mut text, mut omega, mut state) = (String::from("t_s,u_v,omega_rad_s\n"), 0.0_f64, 40 + seed);
    for k in 0..640_u32 {
        let u = LEVELS[((k / 40 + seed) % 8) as usize];
        // Some noise, the same at every run: a linear congruence (Numerical Recipes), its upper bits.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = 0.4 * (f64::from(state >> 16) / 65536.0 - 0.5);
        let _ = writeln!(text, "{:.2},{u},{:.4}", f64::from(k) * 0.01, omega + noise);
        omega = 16.0 * u + (omega - 16.0 * u) * (-0.01_f64 / 0.09).exp();
    }
    text
}

fn good_desk() -> BTreeMap<String, String> {
    let input: String = record(0).lines().fold(String::new(), |mut text, line| {
        let (rest, _) = line.rsplit_once(',').expect("three columns");
        let _ = writeln!(text, "{rest}");
        text
    });
    let files = [
        ("motor.toml", MODEL.to_owned()),
        ("axis.toml", AXIS.to_owned()),
        ("log.csv", record(0)),
        ("holdout.csv", record(3)),
        ("input.csv", input),
    ];
    files.into_iter().map(|(name, text)| (name.to_owned(), text)).collect()
}

fn changed(
    mut files: BTreeMap<String, String>,
    changes: &BTreeMap<String, String>,
) -> BTreeMap<String, String> {
    for (place, text) in changes {
        if let Some((name, from)) = place.split_once('/') {
            let file = files.get_mut(name).unwrap_or_else(|| panic!("{place}: no such file"));
            assert!(file.contains(from), "{place}: the text is not in the file");
            *file = file.replacen(from, text, 1);
        } else if let Some((name, line)) = place.split_once(':') {
            let file = files.get_mut(name).unwrap_or_else(|| panic!("{place}: no such file"));
            let mut lines: Vec<&str> = file.lines().collect();
            lines[line.parse::<usize>().expect("a line") - 1] = text;
            *file = lines.join("\n") + "\n";
        } else {
            files.insert(place.clone(), text.clone());
        }
    }
    files
}

/// What is wrong with the answer to a case; empty if it is good.
fn faults(case: &Case) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let files = changed(good_desk(), &case.with);
    for (name, text) in &files {
        std::fs::write(folder.path().join(name), latin1(text)).unwrap();
    }
    let mut line = format!("exec \"$TRUING\" {}", case.run);
    if case.run.contains("--motor builtin") && !case.run.contains("--image") {
        line += " --image \"$IMAGE\"";
    }
    let mut shell = std::process::Command::new("sh");
    shell
        .args(["-c", &line])
        .current_dir(folder.path())
        .env("TRUING", truing().get_program())
        .env("IMAGE", qemu().image);
    let output = shell.stdin(std::process::Stdio::null()).output().unwrap();
    let said =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    // Lines are wrapped where a terminal ends.
    let flat = said.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut wrong = Vec::new();
    if output.status.code() != Some(case.status) {
        wrong.push(format!("ends with {:?} instead of {}", output.status.code(), case.status));
    }
    let missing = case.says.iter().filter(|word| !flat.contains(word.as_str()));
    wrong.extend(missing.map(|word| format!("does not say `{word}`")));
    let unwanted = case.never.iter().map(String::as_str).chain(["panicked", "RUST_BACKTRACE"]);
    wrong.extend(unwanted.filter(|word| flat.contains(word)).map(|word| format!("says `{word}`")));
    wrong.extend(touched(folder.path(), &files, &case.writes));
    if !wrong.is_empty() {
        wrong.push(format!("it says: {flat:.700}"));
    }
    wrong
}

/// A text with ÿ as the byte of Latin-1, so that a list may hold what is no UTF-8.
fn latin1(text: &str) -> Vec<u8> {
    text.chars().flat_map(|c| if c == 'ÿ' { vec![0xFF] } else { c.to_string().into_bytes() }).collect()
}

/// Inputs that are not as they were, and files that nobody asked for.
fn touched(folder: &Path, files: &BTreeMap<String, String>, wanted: &[String]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (name, text) in files {
        if std::fs::read(folder.join(name)).ok() != Some(latin1(text)) {
            wrong.push(format!("{name} is not as it was"));
        }
    }
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().to_string_lossy().into_owned();
        if !files.contains_key(&name) && !wanted.contains(&name) {
            wrong.push(format!("{name} is left behind"));
        }
    }
    wrong
}

#[test]
fn bad_inputs_are_answered_well() {
    let cases: Vec<(&str, Case)> = LISTS
        .iter()
        .flat_map(|(room, text)| {
            let list: List = toml::from_str(text).unwrap_or_else(|error| panic!("{room}.toml: {error}"));
            list.case.into_iter().map(move |case| (*room, case))
        })
        .collect();
    let _ = (truing(), qemu());
    let answers: Vec<Vec<String>> = cases.par_iter().map(|(_, case)| faults(case)).collect();
    let mut bad = 0;
    for ((room, case), wrong) in cases.iter().zip(&answers).filter(|(_, wrong)| !wrong.is_empty()) {
        bad += 1;
        println!("{room}: truing {} {:?}\n    {}", case.run, case.with, wrong.join("\n    "));
    }
    println!("{} of {} bad inputs are answered well", cases.len() - bad, cases.len());
    assert!(cases.len() >= FEWEST, "{} cases", cases.len());
    assert!((cases.len() - bad) as f64 >= WELL * cases.len() as f64, "{bad} of {} are not", cases.len());
}

/// The desk itself is good: otherwise every refusal above could have another reason.
#[test]
fn the_good_desk_is_accepted() {
    for run in [
        "gap --model motor.toml --log log.csv --holdout holdout.csv --check",
        "simulate --model motor.toml --input input.csv",
        "look log.csv --model motor.toml",
        "start --log log.csv --out new.toml",
    ] {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in good_desk() {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let words: Vec<&str> = run.split_whitespace().collect();
        let output = truing().args(words).current_dir(folder.path()).output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{run}: {errors}{}", String::from_utf8_lossy(&output.stdout));
    }
}
