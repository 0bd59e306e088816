//! Steady tables that were measured elsewhere, and tables with a known answer.

use std::path::Path;
use trials::measured::measured;
use truing::files::log::{self, Columns, Log, Table};
use truing::outcome::{Outcome, Verdict};
use truing::system::model::{self, Model};

fn first_order() -> Model {
    let text = "schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\nfitted_to_log = true\n\
                gain_rad_s_per_v = 11.0\ntime_constant_s = 0.05\n";
    model::parse("linear.toml", text).unwrap()
}

/// The static sweep of one wheel of a micromouse; 8-bit duty of a battery of 7.93 V.
fn wheel(path: &Path, side: &str) -> Outcome {
    let columns: Columns =
        format!("u_v=cmd_pwm_of_255*0.0311,omega_rad_s={side}_rpm*0.104720").parse().unwrap();
    let Log::Dynamic(log) = log::read(path, &columns).unwrap() else { panic!("the sweep has a time column") };
    let model = first_order();
    let table = truing::gap::tables::settled(&model, &log).expect("rows 1.1 s apart are settled");
    truing::gap::tables::run(&model, &table, &[], &[])
}

fn names(outcome: &Outcome) -> Vec<&str> {
    outcome.effects.iter().map(|e| e.name.as_str()).collect()
}

#[test]
fn both_wheels_of_the_micromouse_have_a_dead_zone_and_a_soft_saturation() {
    let Some(path) = measured("micromouse/static_sweep_cal3.csv") else {
        return;
    };
    for (side, least, most) in [("left", 97.0, 98.8), ("right", 98.0, 99.2)] {
        let outcome = wheel(&path, side);
        let fit = outcome.holdout.fit_percent_after;
        assert!(fit > least && fit < most, "{side}: {fit}");
        assert!(names(&outcome).iter().any(|n| n.starts_with("dead_zone")), "{side}: {:?}", names(&outcome));
        let saturation =
            outcome.effects.iter().find(|e| e.name.starts_with("voltage_saturation")).expect("saturation");
        assert!(saturation.parameters["softness"].value > 0.3, "{side}: {saturation:?}");
        let breakaway = names(&outcome).contains(&"stribeck_friction");
        assert_eq!(breakaway, side == "left", "only the left wheel starts far above where it stops");
    }
}

fn table(volts: impl Iterator<Item = f64>, speed: impl Fn(f64) -> f64) -> Table {
    let u_v: Vec<f64> = volts.collect();
    let noise = |k: usize| 0.15 * ((k * 7919 % 101) as f64 / 50.0 - 1.0);
    let omega_rad_s =
        u_v.iter().enumerate().map(|(k, u)| if speed(*u) == 0.0 { 0.0 } else { speed(*u) + noise(k) });
    Table {
        source: "table".into(),
        omega_rad_s: omega_rad_s.collect(),
        u_v,
        speed_unit_rad_s: 1.0,
        names: Default::default(),
    }
}

fn motor() -> Model {
    let text = "schema = \"truing-model/1\"\n[motor]\nR_ohm = 1.5\nKt_nm_per_a = 0.05\nKe_vs_per_rad = 0.05\n\
                J_kgm2 = 2e-4\nb_nms_per_rad = 1e-4\n";
    model::parse("motor.toml", text).unwrap()
}

/// Kt/(R b + Kt Ke) of that motor.
const GAIN: f64 = 0.05 / (1.5 * 1e-4 + 0.05 * 0.05);

#[test]
fn a_complete_model_lacks_nothing() {
    let outcome =
        truing::gap::tables::run(&motor(), &table((-12..=12).map(f64::from), |u| GAIN * u), &[], &[]);
    assert_eq!(outcome.verdict, Verdict::NothingMissing, "{:?}", names(&outcome));
    assert!(outcome.effects.is_empty() && outcome.ties.is_empty());
}

#[test]
fn a_gain_inside_the_tolerance_is_reported_and_not_named() {
    let outcome =
        truing::gap::tables::run(&motor(), &table((-12..=12).map(f64::from), |u| 1.03 * GAIN * u), &[], &[]);
    assert_eq!(outcome.verdict, Verdict::NothingMissing, "{:?}", names(&outcome));
    assert!(outcome.within_tolerance.iter().any(|s| s.parameter == "Kt_nm_per_a" && s.shift_percent < 0.0));
    assert!(outcome.holdout.rmse_after < 0.2 * outcome.holdout.rmse_before, "{:?}", outcome.holdout);
}

#[test]
fn a_dead_zone_in_the_table_is_named_and_tied_with_friction() {
    let zone = |u: f64| GAIN * (u.abs() - 1.4).max(0.0) * u.signum();
    let table = table((-24..=24).map(|k| 0.5 * f64::from(k)), zone);
    let outcome = truing::gap::tables::run(&motor(), &table, &[], &[]);
    assert_eq!(names(&outcome), ["dead_zone"]);
    let width = &outcome.effects[0].parameters["half_width_v"];
    assert!((width.value - 1.4).abs() < 3.0 * width.std.unwrap().max(0.005), "{width:?}");
    assert!(outcome.ties[0].rivals.contains(&vec!["coulomb_friction".to_string()]), "{:?}", outcome.ties);
    // What is not offered is neither a name nor a rival.
    let without = truing::gap::tables::run(&motor(), &table, &[], &["dead_zone".into()]);
    assert_eq!(names(&without), ["voltage_drop"]);
    assert!(without.ties[0].rivals.contains(&vec!["coulomb_friction".to_string()]), "{:?}", without.ties);
    assert!(!without.ties[0].rivals.contains(&vec!["dead_zone".to_string()]), "{:?}", without.ties);
}

#[test]
fn few_points_are_refused_with_a_reason() {
    let outcome =
        truing::gap::tables::run(&motor(), &table([1.0, 2.0, 3.0, 4.0].into_iter(), |u| GAIN * u), &[], &[]);
    assert_eq!(outcome.verdict, Verdict::InsufficientExcitation);
    assert!(outcome.notes[0].contains("4 different voltages; measure at least 6"), "{:?}", outcome.notes);
    let still = truing::gap::tables::run(&motor(), &table((-6..6).map(f64::from), |_| 0.0), &[], &[]);
    assert!(still.notes[0].contains("does not move"), "{:?}", still.notes);
}

#[test]
fn a_shape_outside_the_library_is_called_unexplained() {
    let wavy = |u: f64| GAIN * u + 12.0 * (1.3 * u).sin();
    let outcome =
        truing::gap::tables::run(&motor(), &table((-48..=48).map(|k| 0.25 * f64::from(k)), wavy), &[], &[]);
    assert_eq!(outcome.verdict, Verdict::Unexplained, "{:?}", names(&outcome));
    assert!(outcome.unexplained.structure.contains("smooth function of the voltage"));
}

#[test]
fn a_limit_that_differs_between_the_directions_is_named() {
    let speed = |u: f64| GAIN * u.clamp(-6.2, 8.7);
    let volts = (-24..=24).map(|k| 0.5 * f64::from(k));
    let outcome = truing::gap::tables::run(&motor(), &table(volts, speed), &[], &[]);
    assert_eq!(names(&outcome), ["voltage_saturation_asymmetric"]);
    let limits = &outcome.effects[0].parameters;
    assert!((limits["pos_v"].value - 8.7).abs() < 0.05, "{limits:?}");
    assert!((limits["neg_v"].value - 6.2).abs() < 0.05, "{limits:?}");
}
