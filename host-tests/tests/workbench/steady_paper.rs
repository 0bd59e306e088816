//! The paper's Table 3.1 with the paper's motor: the answer is known from the numbers of the table itself.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use truing::files::log::{self, Columns, Log, Table};
use truing::files::model::{self, Model};
use truing::outcome::{NamedEffect, Outcome, Verdict};
use truing::report::Exporter;
use truing::report::model_file::ModelFile;

const RPM: f64 = std::f64::consts::PI / 30.0;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/paper").join(name)
}

fn motor() -> Model {
    model::read(&data("motor.toml")).unwrap()
}

fn table() -> Table {
    match log::read(&data("table-3.1-speed-vs-voltage.csv"), &Columns::default()).unwrap() {
        Log::Table(table) => table,
        Log::Dynamic(_) => panic!("the paper's table has no time column"),
    }
}

/// One analysis for all tests.
static OUTCOME: LazyLock<Outcome> = LazyLock::new(|| truing::gap::tables::run(&motor(), &table(), &[], &[]));

fn effect<'a>(outcome: &'a Outcome, name: &str) -> &'a NamedEffect {
    outcome.effects.iter().find(|e| e.name == name).unwrap_or_else(|| panic!("{name} is not named"))
}

fn tied(outcome: &Outcome, name: &str) -> Vec<String> {
    let tie = &outcome.ties[effect(outcome, name).tie.expect("a tie")];
    tie.rivals.iter().map(|r| r.join(" + ")).collect()
}

#[test]
fn the_gain_and_the_saturation_are_found_and_both_are_ties() {
    let outcome = &*OUTCOME;
    assert_eq!(outcome.verdict, Verdict::Tie);
    let gain = &effect(outcome, "drive_gain").parameters["ratio"];
    assert!((gain.value - 2.285).abs() < 0.03, "{gain:?}");
    assert_eq!(tied(outcome, "drive_gain"), ["drive_gain", "encoder_scale", "motor_gain + viscous_friction"]);
    let saturation = effect(outcome, "voltage_saturation");
    assert!((saturation.derived["knee_command_v"].value - 6.79).abs() < 0.05, "{saturation:?}");
    assert!((saturation.derived["level_rad_s"].value / RPM - 1547.0).abs() < 1.0, "{saturation:?}");
    let limits = tied(outcome, "voltage_saturation");
    assert!(
        limits[0] == "voltage_saturation" && limits.contains(&"speed_saturation".to_string()),
        "{limits:?}"
    );
    assert!(
        outcome
            .ties
            .iter()
            .all(|t| t.separated_by.contains("over time") || t.separated_by.contains("current"))
    );
    let experiment = outcome.next_experiment.as_ref().expect("an experiment that separates");
    assert!(!experiment.profile.is_empty());
    assert!(
        experiment.profile.iter().all(|s| s.u_v.is_none_or(|u| u.abs() <= 10.5)),
        "within the table's range"
    );
}

#[test]
fn no_dead_zone_is_named_in_any_reading_and_the_bias_is_small() {
    let outcome = &*OUTCOME;
    let named = outcome.effects.iter().map(|e| e.name.clone());
    let rivals = outcome.ties.iter().flat_map(|t| t.rivals.iter().flatten().cloned());
    let wrong =
        ["dead_zone", "dead_zone_asymmetric", "coulomb_friction", "coulomb_asymmetric", "stribeck_friction"];
    let all: Vec<String> = named.chain(rivals).chain(outcome.closest_known.clone()).collect();
    assert!(all.iter().all(|n| !wrong.contains(&n.as_str())), "{all:?}");
    let lost = outcome.rivals.iter().find(|r| r.names == ["dead_zone"]).expect("a dead zone was considered");
    assert!(
        lost.reason.starts_with("added, it leaves 2.") && lost.gap > 0.9 * outcome.holdout.rmse_after,
        "{}",
        lost.reason
    );
    let bias = &effect(outcome, "voltage_offset").derived["zero_speed_at_v"];
    assert!((bias.value + 0.0635).abs() < 0.01, "{bias:?}");
    assert!(outcome.notes.iter().any(|n| n.contains("lowest voltage is 0.9 V")));
}

#[test]
fn the_gap_shrinks_step_by_step_on_points_held_out() {
    let outcome = &*OUTCOME;
    let held = &outcome.holdout;
    assert_eq!((held.signal.as_str(), outcome.gap_unit.as_str()), ("speed_rpm", "rpm"));
    assert!((held.rmse_before - 515.0).abs() < 3.0, "{held:?}");
    assert!(held.rmse_after > 2.0 && held.rmse_after < 3.3, "{held:?}");
    assert!(held.noise_floor > 1.5 && held.noise_floor < 3.5, "{held:?}");
    assert!(held.fit_percent_after > 99.3 && held.fit_percent_after < 99.7, "{held:?}");
    let gaps: Vec<f64> = outcome.steps.iter().map(|s| s.gap).collect();
    assert_eq!(gaps.len(), 4);
    assert!(gaps.windows(2).all(|w| w[1] < 0.5 * w[0]), "{gaps:?}");
    for (k, effect) in outcome.effects.iter().enumerate() {
        assert_eq!((effect.gap_before, effect.gap_after), (gaps[k], gaps[k + 1]));
    }
    let shares: f64 = outcome.places.iter().map(|p| p.share_of_squared_error).sum();
    assert!((shares - 1.0).abs() < 1e-9);
}

#[test]
fn the_extended_model_lacks_nothing_more() {
    let outcome = &*OUTCOME;
    let original = std::fs::read_to_string(data("motor.toml")).unwrap();
    let text = ModelFile { original: &original, origin: "truing gap" }.export(outcome).unwrap();
    let extended = model::parse("extended.toml", &text).unwrap();
    let again = truing::gap::tables::run(&extended, &table(), &[], &[]);
    assert_eq!(again.verdict, Verdict::NothingMissing, "{:?}", again.effects);
    assert!(again.holdout.rmse_before < 3.3, "{:?}", again.holdout);
}

#[test]
fn the_same_table_gives_the_same_report() {
    let json = || {
        let mut outcome = truing::gap::tables::run(&motor(), &table(), &[], &[]);
        outcome.runtime_s = 0.0;
        truing::report::json::Json.export(&outcome).unwrap()
    };
    assert_eq!(json(), json());
}
