//! Rigs of other people whose effects are known: what `truing judge` says of them, as a test. Expectations stand in
//! `data/rigs/*/expect.toml` and are written from what is known of the rig.

use rayon::prelude::*;
use std::path::{Path, PathBuf};
use trials::{extent, measured};
use truing::files::log::{self, Columns, Dynamic, Log};
use truing::files::model::{self, Model};
use truing::gap::{self, Options};
use truing::outcome::{Grade, Outcome, Verdict};
use truing::proving::commands::judge::answer;
use truing::proving::commands::rig::Rig;
use truing::system::effects;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/rigs")
}

fn names(outcome: &Outcome) -> Vec<String> {
    outcome.effects.iter().map(|effect| effect.name.clone()).collect()
}

/// Whether a number of each named effect, or the difference of its sides, lies beyond three of its standard deviations from nothing;
/// effects without numbers do.
fn indistinct(outcome: &Outcome) -> Vec<&str> {
    let vague = |effect: &&truing::outcome::NamedEffect| {
        let known = effects::find(&effect.name).expect("in the library");
        let clear = |(key, value): (&String, &truing::outcome::Value)| {
            let parameter =
                known.parameters.iter().find(|p| p.name == *key || effects::linear_key(p.name) == *key);
            let nothing = parameter.map_or(0.0, effects::Parameter::nothing);
            value.std.is_none_or(|std| (value.value - nothing).abs() > 3.0 * std)
        };
        !effect.parameters.is_empty() && !effect.parameters.iter().chain(&effect.derived).any(clear)
    };
    let effects = outcome.effects.iter().filter(vague);
    effects.map(|effect| effect.name.as_str()).collect()
}

/// The rigs whose search takes longest; they are judged in `cargo xtask test --all`.
const LONG: [&str; 5] = ["andromeda_drive", "eagle_swerve", "odrive_cog", "sar_micro", "sar_so"];

/// Friction of the shaft and dead zone of the drive are one question: where one richer name leaves as little, it is said alone.
fn said_twice(outcome: &Outcome) -> bool {
    let frictions =
        ["dead_zone", "dead_zone_asymmetric", "coulomb_friction", "coulomb_asymmetric", "stribeck_friction"];
    names(outcome).iter().filter(|name| frictions.contains(&name.as_str())).count() > 1
}

#[test]
fn the_rigs_of_other_people_are_named_as_is_known_of_them() {
    let mut rigs = Rig::all(&folder()).unwrap();
    assert!(rigs.len() >= 26, "{} rigs", rigs.len());
    rigs.retain(|rig| extent::all() || !LONG.contains(&rig.name.as_str()));
    let shared = measured::root();
    let wrong: Vec<String> = rigs
        .par_iter()
        .filter_map(|rig| {
            let Some(outcome) = answer(rig, Some(&shared), &Options::default()).unwrap() else {
                measured::skip(&format!(
                    "the data of rig {} not present, see docs/measured-data.md",
                    rig.name
                ));
                return None;
            };
            let mut faults = rig.expectation.faults(&outcome);
            let held = &outcome.holdout;
            if !outcome.effects.is_empty() && held.rmse_after >= held.rmse_before {
                faults.push("names that do not shrink the held-out gap".into());
            }
            if rig.name == "odrive_cog" && (said_twice(&outcome) || held.fit_percent_after <= 79.0) {
                faults.push("one friction under two names, or a name too few".into());
            }
            let record = outcome.steps.len() > 1 && !rig.name.contains("sweep") && rig.name != "un_map";
            faults.extend(
                indistinct(&outcome)
                    .iter()
                    .filter(|_| record)
                    .map(|name| format!("{name} within three deviations of nothing")),
            );
            (!faults.is_empty() && rig.expectation.shortfall.is_none())
                .then(|| format!("{}: {} ({})", rig.name, faults.join("; "), names(&outcome).join(" + ")))
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A rig with its log and its held-out record.
fn opened(name: &str) -> (Model, Dynamic, Dynamic) {
    let folder = folder().join(name);
    let record = |file: &str| match log::read(&folder.join(file), &Columns::default()).unwrap() {
        Log::Dynamic(log) => log,
        Log::Table(_) => panic!("{name}: a table"),
    };
    let model = model::read(&folder.join("model.toml")).unwrap();
    (model, record("log.csv"), record("holdout.csv"))
}

/// Its runs from one place on, as a record of their own.
fn runs(record: &Dynamic, which: impl Fn(usize) -> bool, source: &str) -> Dynamic {
    let kept = record.runs.iter().enumerate().filter(|(k, _)| which(*k));
    Dynamic { source: source.into(), runs: kept.map(|(_, run)| run.clone()).collect(), ..record.clone() }
}

/// Every held-out record has the same veto, in whatever order they are shown; what is left stands beside the names.
#[test]
fn names_do_not_depend_on_the_order_of_the_held_out_records() {
    let (model, log, holdout) = opened("angel_drive");
    assert!(holdout.runs.len() > 1);
    let first = runs(&holdout, |k| k % 2 == 0, "first");
    let second = runs(&holdout, |k| k % 2 == 1, "second");
    let said = |holdouts: &[Dynamic]| {
        let outcome = gap::run(&model, &log, holdouts, &Options::default(), &|_| {}).unwrap();
        (names(&outcome), outcome.verdict, outcome.unexplained.share_of_gap)
    };
    let one_way = said(&[first.clone(), second.clone()]);
    let other_way = said(&[second, first]);
    assert_eq!(one_way, other_way);
    assert!(!one_way.0.is_empty() && one_way.2 > 0.0, "{one_way:?}");
}

/// A name that hardly lifts the held-out fit stands apart and is not in the model; a gap of which more than half is left has names that
/// are likely, and one of which little is left has names that are named.
#[test]
fn the_grade_says_how_much_the_names_explain() {
    let said = |name: &str| {
        let (model, log, holdout) = opened(name);
        gap::run(&model, &log, &[holdout], &Options::default(), &|_| {}).unwrap()
    };
    let drive = said("frc5409_drive");
    assert_eq!(drive.grade, Grade::NamedAndSomethingIsLeft);
    assert!(drive.small.iter().all(|small| small.fit_points < 0.5), "{:?}", drive.small);
    let small: Vec<&str> = drive.small.iter().map(|small| small.name.as_str()).collect();
    assert!(!small.is_empty() && small.iter().all(|name| !names(&drive).iter().any(|it| it == name)));
    // A delay may be the logger's own.
    let early = |outcome: &Outcome| {
        outcome.notes.iter().any(|note| note.contains("ms early would look like this delay"))
    };
    assert!(names(&drive).contains(&"transport_delay".to_owned()) && early(&drive), "{:?}", drive.notes);
    let outrunner = said("laas_acc");
    assert!(!early(&outrunner));
    assert_eq!((outrunner.verdict, outrunner.grade), (Verdict::Named, Grade::Likely));
    let left = |outcome: &Outcome| (outcome.holdout.rmse_after / outcome.holdout.rmse_before).powi(2);
    assert!(left(&outrunner) > 0.5 && left(&drive) < 0.5);
}

/// A rough model whose file does not say so is read as one, as long as nobody vouches for its numbers.
#[test]
fn numbers_that_nobody_vouches_for_are_fitted_freely_where_nothing_explains_a_log() {
    let said = |name: &str, change: &dyn Fn(String) -> String| {
        let (_, log, holdout) = opened(name);
        let text = std::fs::read_to_string(folder().join(name).join("model.toml")).unwrap();
        let model = model::parse("model.toml", &change(text)).unwrap();
        let outcome = gap::run(&model, &log, &[holdout], &Options::default(), &|_| {}).unwrap();
        (names(&outcome), outcome.notes.iter().any(|note| note.contains("does not state how well")))
    };
    let unsaid = |text: String| text.replace("fitted_to_log = true\n", "");
    let quicker = |text: String| {
        let line = text.lines().find(|line| line.starts_with("time_constant_s = ")).unwrap();
        let value: f64 = line.split(" = ").nth(1).unwrap().parse().unwrap();
        unsaid(text.replace(line, &format!("time_constant_s = {}", 0.7 * value)))
    };
    for rig in ["frc501_drive", "thomas_drive"] {
        let (told, note) = said(rig, &|text| text);
        assert!(!told.is_empty() && !note);
        assert_eq!(said(rig, &unsaid), (told.clone(), true), "{rig}");
        assert_eq!(said(rig, &quicker), (told, true), "{rig}");
        let stated = |text: String| quicker(text) + "\n[tolerance]\ndefault = 0.05\n";
        assert!(!said(rig, &stated).1, "{rig}");
    }
}

/// Each speed of this map answers the input of the row before; read a row off, it had a sensor's offset and two different sides.
#[test]
fn a_settled_map_is_read_with_the_row_that_it_answers() {
    let (model, log, holdout) = opened("un_map");
    let outcome = gap::run(&model, &log, &[holdout], &Options::default(), &|_| {}).unwrap();
    assert!(!names(&outcome).iter().any(|name| name == "sensor_offset"), "{:?}", names(&outcome));
    assert!(outcome.holdout.fit_percent_after > 99.0, "{:?}", outcome.holdout);
    assert!(outcome.notes.iter().any(|note| note.contains("the row before")), "{:?}", outcome.notes);
}

/// A first-order model tells friction in volts at the terminals: what it takes to start, whatever gain the file states.
#[test]
fn friction_in_volts_follows_the_fitted_gain() {
    let (model, log, holdout) = opened("angel_drive");
    let outcome = gap::run(&model, &log, &[holdout], &Options::default(), &|_| {}).unwrap();
    let friction = outcome.effects.iter().find(|effect| effect.name == "coulomb_friction").unwrap();
    let torque = friction.parameters["level_nm"].value;
    let shift = outcome.within_tolerance.iter().find(|shift| shift.parameter == "gain_rad_s_per_v").unwrap();
    let given = match model.kind {
        truing::files::model::Kind::FirstOrder { gain_rad_s_per_v, .. } => gain_rad_s_per_v,
        _ => panic!("a first-order model"),
    };
    let expected = torque * given * (1.0 + shift.shift_percent / 100.0);
    let told = friction.derived["level_v"].value;
    assert!((told / expected - 1.0).abs() < 1e-6 && shift.shift_percent.abs() > 5.0, "{told} {expected}");
}

/// A record given as final is predicted and chooses nothing; a copy of a record that had a veto is refused.
#[test]
fn a_final_record_is_only_predicted() {
    let (model, log, holdout) = opened("frc501_drive");
    let veto = runs(&holdout, |k| k == 0, "veto");
    let last = runs(&holdout, |k| k > 0, "last");
    let said = |finals: Vec<Dynamic>| {
        let options = Options { finals, ..Options::default() };
        gap::run(&model, &log, std::slice::from_ref(&veto), &options, &|_| {})
    };
    let (without, with) = (said(Vec::new()).unwrap(), said(vec![last]).unwrap());
    assert_eq!(names(&without), names(&with));
    assert_eq!(without.holdout, with.holdout);
    assert_eq!(without.final_records, None);
    let predicted = with.final_records.unwrap();
    assert!(predicted.rmse_after < predicted.rmse_before, "{predicted:?}");
    let refused = said(vec![veto.clone()]).unwrap_err().to_string();
    assert!(refused.contains("give --final another record"), "{refused}");
}

/// Another motor's record, which the model misses by many times the noise, is no proof that nothing is missing.
#[test]
fn a_held_out_record_of_another_motor_is_not_nothing_missing() {
    use trials::case_files::opened;
    use truing::synthetic::cases::{Set, Spec, draw};
    let spec = Spec { rows: 1500, ..Spec::new(Set::Nothing) };
    // The same drive and the same rates, so that the files fit together.
    let case = opened(&draw(&spec, 61)).unwrap();
    let right =
        gap::run(&case.model, &case.log, std::slice::from_ref(&case.holdout), &Options::default(), &|_| {});
    assert_eq!(right.unwrap().verdict, Verdict::NothingMissing);
    let mut other = case.holdout.clone();
    for run in &mut other.runs {
        run.speed.iter_mut().flatten().for_each(|speed| *speed *= 0.6);
        run.position.iter_mut().flatten().for_each(|position| *position *= 0.6);
        run.current_a = None;
    }
    let mut log = case.log.clone();
    log.runs.iter_mut().for_each(|run| run.current_a = None);
    let outcome = gap::run(&case.model, &log, &[other], &Options::default(), &|_| {}).unwrap();
    assert_eq!(outcome.verdict, Verdict::Unexplained, "{:?}", names(&outcome));
    assert!(
        outcome.unexplained.structure.contains("misses a held-out record"),
        "{}",
        outcome.unexplained.structure
    );
}

/// One short run in one direction, missed by many times the noise, shows no structure; that is no proof that nothing is missing.
#[test]
fn a_short_log_that_is_missed_is_not_nothing_missing() {
    let (model, log, holdout) = opened("durham_elevator");
    let outcome = gap::run(&model, &holdout, &[log], &Options::default(), &|_| {}).unwrap();
    assert_eq!(outcome.verdict, Verdict::Unexplained, "{:?}", names(&outcome));
    let structure = &outcome.unexplained.structure;
    assert!(structure.contains("too few samples"), "{structure}");
}
