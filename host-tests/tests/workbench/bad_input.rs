//! `truing gap` on input that cannot be right: what it says, file by file, and that an extended model misses nothing more.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use trials::case_files::{Opened, opened};
use truing::cli::gap::{Arguments, run};
use truing::gap::{self, Options};
use truing::outcome::{Outcome, Verdict};
use truing::report::{Exporter, model_file::ModelFile};
use truing::synthetic::cases::{Case, Set, Spec, draw};
use truing::system::model;

/// Effects that the tests hide.
const NAMES: [&str; 3] = ["dead_zone", "coulomb_friction", "motor_gain"];

/// Design cases with one plainly visible effect each, drawn once.
static CASES: LazyLock<BTreeMap<&str, Case>> = LazyLock::new(|| {
    let spec = Spec { rows: 1200, dirty: Some(false), ..Spec::new(Set::Single) };
    let mut cases = BTreeMap::new();
    for case in (1..1000).map(|seed| draw(&spec, seed)) {
        let hidden = &case.answer.hidden[0];
        if NAMES.contains(&hidden.name) && hidden.visibility > 5.0 && hidden.form_in_library {
            cases.entry(hidden.name).or_insert(case);
        }
        if cases.len() == NAMES.len() {
            break;
        }
    }
    cases
});

fn hidden(name: &str) -> &'static Case {
    &CASES[name]
}

fn written(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

/// The command on these texts; what it refuses with, or the JSON it writes.
fn command(model: &str, log: &str, holdout: Option<&str>, without: &[&str]) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let arguments = Arguments {
        model: written(folder.path(), "model.toml", model),
        log: written(folder.path(), "log.csv", log),
        holdout: holdout.map(|text| written(folder.path(), "holdout.csv", text)).into_iter().collect(),
        finals: Vec::new(),
        rows: truing::console::rows::Rows::default(),
        without: without.iter().map(|name| (*name).to_owned()).collect(),
        out: None,
        json: Some(path("outcome.json")),
        pictures: None,
        report: None,
        accept_data: false,
        check: false,
    };
    run(&arguments).map_err(|error| format!("{error:#}"))?;
    Ok(std::fs::read_to_string(path("outcome.json")).unwrap())
}

fn refused(model: &str, log: &str, holdout: Option<&str>, without: &[&str], words: &[&str]) {
    let text = command(model, log, holdout, without).unwrap_err();
    for word in words {
        assert!(text.contains(word), "`{word}` is missing: {text}");
    }
}

/// Every row's value of a column replaced.
fn with_column(csv: &str, column: &str, value: impl Fn(f64) -> f64) -> String {
    let mut lines = csv.lines();
    let header = lines.next().unwrap();
    let place = header.split(',').position(|name| name == column).unwrap();
    let row = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[place] = value(cells[place].parse().unwrap()).to_string();
        cells.join(",")
    };
    let rows: Vec<String> = lines.map(row).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

fn first_rows(csv: &str, rows: usize) -> String {
    csv.lines().take(rows + 1).collect::<Vec<_>>().join("\n") + "\n"
}

#[test]
fn a_hold_out_that_is_the_log_proves_nothing() {
    let case = hidden("dead_zone");
    let log = case.log.to_csv();
    refused(&case.model, &log, Some(&log), &[], &["holdout.csv", "log.csv", "a copy proves nothing"]);
}

#[test]
fn rpm_in_a_column_of_radians_a_second_are_called_out() {
    let case = hidden("dead_zone");
    let rpm = with_column(&case.log.to_csv(), "omega_rad_s", |omega| omega * 60.0 / std::f64::consts::TAU);
    let words = ["nothing was simulated", "omega_rad_s is in rpm", "omega_rad_s*0.10472", "--accept-data"];
    refused(&case.model, &rpm, None, &[], &words);
    let json = command(&case.model, &case.log.to_csv(), None, &[]).unwrap();
    assert!(!json.contains("rpm"), "{json}");
}

#[test]
fn a_mistyped_effect_is_answered_with_the_nearest_name() {
    let case = hidden("dead_zone");
    let log = case.log.to_csv();
    refused(&case.model, &log, None, &["dead_zne"], &["--without", "`dead_zne`", "nearest is `dead_zone`"]);
    let known = format!("{}[known.coulomb_fricton]\nlevel_nm = 0.01\n", case.model);
    refused(&known, &log, None, &[], &["model.toml", "nearest is [known.coulomb_friction]"]);
}

#[test]
fn too_few_samples_are_refused_or_answered_without_a_name() {
    let case = hidden("dead_zone");
    let log = case.log.to_csv();
    refused(&case.model, &first_rows(&log, 3), None, &[], &["log.csv"]);
    // Some rows of one piece: whatever they allow to say, it is no name in confidence.
    let json = command(&case.model, &first_rows(&log, 25), None, &[]).unwrap();
    assert!(!json.contains("\"verdict\": \"named\""), "{json}");
}

#[test]
fn a_log_that_never_moves_tests_nothing() {
    let case = hidden("dead_zone");
    let log = case.log.to_csv();
    let still = with_column(&log, "omega_rad_s", |_| 0.0);
    let still = with_column(&still, "theta_rad", |_| 1.0);
    let json = command(&case.model, &still, None, &[]).unwrap();
    assert!(json.contains("insufficient_excitation"), "{json}");
    assert!(json.contains("the log never moves"), "{json}");
    let silent = with_column(&log, "u_v", |_| 0.0);
    refused(&case.model, &silent, None, &[], &["log.csv", "u_v is 0 throughout"]);
}

fn analysed(files: &Opened, model: &model::Model) -> Outcome {
    let holdouts = std::slice::from_ref(&files.holdout);
    gap::run(model, &files.log, holdouts, &Options::default(), &|_| {}).unwrap()
}

/// The extended model knows its effects: run again on the same log, nothing is missing, and a known effect is no candidate.
#[test]
fn the_extended_model_misses_nothing_more() {
    for name in NAMES {
        let files = opened(hidden(name)).unwrap();
        let outcome = analysed(&files, &files.model);
        let names: Vec<&str> = outcome.effects.iter().map(|effect| effect.name.as_str()).collect();
        assert_eq!(names, [name], "{:?}", outcome.verdict);
        let text =
            ModelFile { original: &files.model.source_text, origin: "log.csv" }.export(&outcome).unwrap();
        let extended = model::parse("extended.toml", &text).unwrap();
        let again = analysed(&files, &extended);
        assert_eq!(
            (again.verdict, again.effects.len()),
            (Verdict::NothingMissing, 0),
            "{name}: {:?}",
            again.effects
        );
        let (before, after) = (outcome.holdout.rmse_after, again.holdout.rmse_after);
        assert!((after / before - 1.0).abs() < 0.02, "{name}: {before} then {after}");
    }
}
