//! The generator of hidden cases: what it writes can be read, repeats by seed, and hides what the answer says.

use std::collections::BTreeSet;
use trials::case_files::opened;
use truing::cli;
use truing::gap::{self, Options};
use truing::outcome::Verdict;
use truing::synthetic::cases::hidden::KINDS;
use truing::synthetic::cases::outside::OUTSIDERS;
use truing::synthetic::cases::{Case, Set, Spec, draw, rms_difference};
use truing::system::effects::LIBRARY;

fn spec(set: Set) -> Spec {
    Spec { rows: 1200, ..Spec::new(set) }
}

#[test]
fn same_seed_gives_the_same_files_and_evaluation_gives_others() {
    for set in [Set::Nothing, Set::Single, Set::Outside] {
        let (once, again) = (draw(&spec(set), 7), draw(&spec(set), 7));
        assert_eq!((&once.model, once.log.to_csv()), (&again.model, again.log.to_csv()));
        assert_eq!(once.holdout, again.holdout);
        let evaluation = draw(&Spec { evaluation: true, ..spec(set) }, 7);
        assert_ne!(once.model, evaluation.model);
        assert_ne!(once.log, once.holdout);
    }
}

#[test]
fn names_are_those_of_the_library() {
    // These cases are records over time; an effect that only tables may name hides in none.
    let library = LIBRARY.iter().filter(|effect| effect.on_records());
    let library: BTreeSet<&str> = library.map(|effect| effect.name).collect();
    let hidden: BTreeSet<&str> = KINDS.iter().map(|kind| kind.effect.name).collect();
    assert_eq!(library, hidden, "every effect of the library can hide");
    assert!(OUTSIDERS.len() >= 10);
    assert!(OUTSIDERS.iter().all(|outsider| !library.contains(outsider.name)));
}

#[test]
fn nothing_missing_differs_from_the_truth_by_noise_of_the_declared_size() {
    for seed in 0..6 {
        let case = draw(&spec(Set::Nothing), seed);
        assert!(case.answer.hidden.is_empty() && case.answer.outside.is_none());
        let noise = rms_difference(case.holdout.column("omega_rad_s"), &case.noiseless);
        assert!((5e-4..3e-2).contains(&(noise / case.answer.full_speed)), "{noise}");
        // Off by at most two tolerances, and off at all.
        let ratio = case.answer.claimed.J_kgm2 / case.answer.base.J_kgm2 - 1.0;
        assert!(ratio != 0.0 && ratio.abs() <= 2.0 * case.answer.tolerance);
    }
}

#[test]
fn pairs_and_triples_are_visible_and_outsiders_plainly() {
    for (set, number) in [(Set::Pair, 2), (Set::Triple, 3)] {
        for seed in 0..3 {
            let answer = draw(&spec(set), seed).answer;
            assert_eq!(answer.hidden.len(), number);
            assert!(answer.hidden.iter().all(|effect| effect.visibility >= 0.3), "{:?}", answer.hidden);
        }
    }
    for seed in 0..4 {
        assert!(draw(&spec(Set::Outside), seed).answer.outside.is_some());
    }
}

/// Beside a model that is a fit no share shows a winding that heats; where a set reaches the noise, it is named all the same.
#[test]
fn what_reaches_the_noise_is_named_beside_a_fit_too() {
    let cases = (0..400).map(|seed| draw(&Spec::new(Set::Single), seed));
    let heats = |case: &Case| {
        let hidden = &case.answer.hidden[0];
        hidden.name == "thermal_resistance" && hidden.visibility > 8.0
    };
    let heating: Vec<Case> = cases.filter(heats).take(4).collect();
    let named = heating.iter().filter(|case| {
        let model = case.model.replacen("[model]", "[model]\nfitted_to_log = true", 1);
        let files = opened(&Case { model, ..(*case).clone() }).unwrap();
        let outcome =
            gap::run(&files.model, &files.log, &[files.holdout], &Options::default(), &|_| {}).unwrap();
        outcome.effects.iter().map(|effect| effect.name.as_str()).eq(["thermal_resistance"])
    });
    // Where another effect removes a large share far from the noise, it stands.
    let named = named.count();
    assert!(heating.len() == 4 && named >= 3, "{named}");
}

/// A friction that grips in one sector of the turn leaves little beside Stribeck friction, and beside that and cogging still less; the
/// place within the turn predicts it.
#[test]
fn friction_in_one_sector_of_a_turn_stays_unexplained() {
    let cases = (120..140).map(|seed| draw(&Spec::new(Set::Outside), seed));
    let gripping: Vec<Case> = cases.filter(|case| case.answer.outside == Some("sticking_sector")).collect();
    assert!(gripping.len() > 2);
    for case in gripping {
        let files = opened(&case).unwrap();
        let outcome =
            gap::run(&files.model, &files.log, &[files.holdout], &Options::default(), &|_| {}).unwrap();
        assert_eq!(outcome.verdict, Verdict::Unexplained, "{}", case.answer.seed);
        assert!(outcome.unexplained.structure.contains("turn"), "{}", outcome.unexplained.structure);
    }
}

#[test]
fn singles_range_from_barely_visible_to_large() {
    let cases: Vec<_> = (0..60).map(|seed| draw(&spec(Set::Single), seed).answer).collect();
    let visibility = |low: f64, high: f64| {
        cases.iter().filter(|answer| (low..high).contains(&answer.hidden[0].visibility)).count()
    };
    assert!(visibility(0.0, 1.0) >= 3, "{}", visibility(0.0, 1.0));
    assert!(visibility(10.0, f64::INFINITY) >= 10);
    let kinds: BTreeSet<&str> = cases.iter().map(|answer| answer.hidden[0].name).collect();
    assert!(kinds.len() > 20, "{kinds:?}");
    let exact = cases.iter().filter(|answer| answer.hidden[0].form_in_library).count();
    assert!((35..60).contains(&exact), "{exact}");
}

#[test]
fn what_is_written_can_be_read_and_the_answer_stays_apart() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (out, answers) = (folder.path().join("cases"), folder.path().join("answers"));
    let run = |answers: &std::path::Path| {
        let arguments = ["truing", "cases", "--set", "single", "--count", "2", "--rows", "900", "--out"];
        let paths = [out.as_os_str(), "--answers".as_ref(), answers.as_os_str()];
        let all = arguments.iter().map(|a| a.as_ref()).chain(paths);
        <cli::Cli as clap::Parser>::try_parse_from(all).expect("arguments").run()
    };
    run(&answers).expect("cases");
    let model = truing::files::model::read(&out.join("case-00001/model.toml")).expect("model");
    assert!(model.known.is_empty());
    assert!(!std::fs::read_to_string(out.join("case-00001/model.toml")).expect("text").contains("hidden"));
    assert!(answers.join("case-00002.json").exists());
    let inside = out.join("answers");
    let error = run(&inside).expect_err("answers inside the cases");
    assert!(error.to_string().contains("--answers"), "{error}");
}

/// Teeth that meet make a rugged cost, whose covariance knows one hollow alone: it put numbers of these motors up to 100 of its standard
/// deviations away from the truth.
#[test]
fn numbers_of_a_motor_with_play_are_as_sure_as_they_say() {
    let mut errors = Vec::new();
    for seed in [3189, 3235, 3243] {
        let case = draw(&Spec::new(Set::Single), seed);
        let files = opened(&case).expect("files");
        let outcome = gap::run(&files.model, &files.log, &[files.holdout], &Options::default(), &|_| {})
            .expect("an outcome");
        let [effect] = outcome.effects.as_slice() else { panic!("seed {seed}: {:?}", outcome.effects) };
        assert_eq!(effect.name, "backlash", "seed {seed}");
        for (name, truth) in &case.answer.hidden[0].parameters {
            let number = &effect.parameters[*name];
            errors.push((number.value - truth).abs() / number.std.expect("an uncertainty"));
        }
        let (truth, told) = (case.answer.base, case.answer.claimed);
        for shift in &outcome.within_tolerance {
            let ratio = match shift.parameter.as_str() {
                "R_ohm" => truth.R_ohm / told.R_ohm,
                "L_h" => truth.L_h / told.L_h,
                "J_kgm2" => truth.J_kgm2 / told.J_kgm2,
                "b_nms_per_rad" => truth.b_nms_per_rad / told.b_nms_per_rad,
                _ => truth.K_nm_per_a / told.K_nm_per_a,
            };
            errors.push((shift.shift_percent - 100.0 * (ratio - 1.0)).abs() / shift.std_percent);
        }
    }
    let within = errors.iter().filter(|error| **error < 1.96).count();
    assert!(within + 3 >= errors.len() && errors.iter().all(|error| *error < 4.0), "{errors:.1?}");
}
