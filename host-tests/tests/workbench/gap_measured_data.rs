//! Measured rigs of other people: expected answers with limits on both sides.

use std::path::Path;
use trials::measured::measured;
use truing::files::log::{self, Columns, Dynamic, Log, Run};
use truing::gap::{self, Options};
use truing::outcome::{Outcome, Verdict};
use truing::system::model::{self, Model};

fn record(path: &Path, columns: &str) -> Dynamic {
    let columns: Columns = columns.parse().unwrap();
    match log::read(path, &columns).unwrap() {
        Log::Dynamic(log) => log,
        Log::Table(_) => panic!("{}: a table", path.display()),
    }
}

fn model(text: &str) -> Model {
    model::parse("model.toml", &format!("schema = \"truing-model/1\"\n{text}")).unwrap()
}

fn analysed(model: &Model, log: &Dynamic, holdouts: &[Dynamic], without: &[&str]) -> Outcome {
    let options =
        Options { without: without.iter().map(|name| (*name).to_owned()).collect(), ..Options::default() };
    gap::run(model, log, holdouts, &options, &|_| {}).unwrap()
}

fn names(outcome: &Outcome) -> Vec<&str> {
    outcome.effects.iter().map(|effect| effect.name.as_str()).collect()
}

fn between(value: f64, low: f64, high: f64) {
    assert!((low..high).contains(&value), "{value} is not between {low} and {high}");
}

/// The published mass, viscous friction and force constant of EMPS (Janot, Gautier, Brunot, 2019).
fn emps() -> Model {
    model(
        "[model]\nkind = \"inertia\"\n[motor]\nmass_kg = 95.1089\nviscous = 203.5034\ndrive_gain = 35.15065\ndrive_gain_unit = \"N/V\"\n[tolerance]\ndrive_gain = 0.02\n",
    )
}

/// First and second half of a record.
fn halves(log: &Dynamic) -> (Dynamic, Dynamic) {
    let run = &log.runs[0];
    let half = |from: usize, to: usize, source: &str| Dynamic {
        source: source.into(),
        runs: vec![run.rows_between(from, to, 0)],
        ..log.clone()
    };
    (half(0, run.rows() / 2, "first half"), half(run.rows() / 2, run.rows(), "second half"))
}

#[test]
fn emps_needs_friction_that_depends_on_the_direction() {
    let Some(path) = measured("emps/emps_id.csv") else {
        return;
    };
    let Some(pulses) = measured("emps/emps_pulses.csv") else {
        return;
    };
    let (identify, held_out) = halves(&record(&path, "u_v=u_V"));
    let outcome = analysed(&emps(), &identify, &[held_out], &[]);
    let found = names(&outcome);
    let directed = ["coulomb_asymmetric", "viscous_asymmetric", "constant_load", "voltage_offset"];
    assert!(found.iter().any(|name| directed.contains(name)), "{found:?}");
    assert!(
        !found.contains(&"stribeck_friction") && outcome.verdict != Verdict::Unexplained,
        "{found:?} {:?}",
        outcome.verdict
    );
    between(outcome.holdout.fit_percent_after, 98.0, 99.5);
    let outcome = analysed(&emps(), &identify, &[record(&pulses, "u_v=u_V")], &[]);
    between(outcome.holdout.fit_percent_after, 94.5, 96.5);
}

/// With Coulomb friction and a constant load alone the published values come out (20.39 N and 3.16 N against the motor), at the
/// published force constant: force, mass and friction are known up to a common factor only.
#[test]
fn emps_with_coulomb_and_offset_only_gives_the_published_friction() {
    let Some(path) = measured("emps/emps_id.csv") else {
        return;
    };
    let (identify, held_out) = halves(&record(&path, "u_v=u_V"));
    let allowed = ["coulomb_friction", "constant_load"];
    let names_of = |effect: &&truing::system::effects::Effect| effect.name;
    let others = truing::system::effects::LIBRARY.iter().map(names_of);
    let without: Vec<&str> = others.filter(|name| !allowed.contains(name)).collect();
    let rig = model(
        "[model]\nkind = \"inertia\"\n[motor]\nmass_kg = 95.1089\nviscous = 203.5034\ndrive_gain = 35.15065\ndrive_gain_unit = \"N/V\"\n[tolerance]\ndrive_gain = 0.0\n",
    );
    let outcome = analysed(&rig, &identify, &[held_out], &without);
    assert_eq!(names(&outcome), allowed);
    between(outcome.effects[0].parameters["level_n"].value, 18.9, 21.9);
    between(outcome.effects[1].parameters["torque_n"].value, 2.6, 3.8);
    between(outcome.holdout.fit_percent_after, 94.5, 96.0);
}

/// A pendulum: gravity must be found by its name, and friction.
#[test]
fn the_pendulum_needs_gravity() {
    let Some(path) = measured("dfki_pendulum/direct_collocation.csv") else {
        return;
    };
    let Some(other) = measured("dfki_pendulum/ddp.csv") else {
        return;
    };
    let rig = model(
        "[model]\nkind = \"inertia\"\nfitted_to_log = true\n[motor]\ninertia_kgm2 = 0.05\nviscous = 0.03\n[tolerance]\ndrive_gain = 0.02\n",
    );
    let outcome = analysed(&rig, &record(&path, ""), &[record(&other, "")], &[]);
    assert!(names(&outcome).contains(&"gravity"), "{:?}", names(&outcome));
    assert!(outcome.holdout.fit_percent_before < 0.0);
    between(outcome.holdout.fit_percent_after, 70.0, 97.0);
}

/// A micromouse's left wheel from rest to 200 rpm: a delay is a decoy; the threshold of the drive is the answer.
/// The gain has to grow almost fourfold together with the zone.
#[test]
fn the_micromouse_has_a_dead_zone_not_a_delay() {
    let set = |ms: u32| measured(&format!("micromouse/closedloop_controllerDelayImpact{ms}ms.csv"));
    let (Some(two), Some(ten), Some(one), Some(five)) = (set(2), set(10), set(1), set(5)) else {
        return;
    };
    let read = |path: &Path| record(path, "u_v=left_cmd_pwm255*0.031098,omega_rad_s=left_rpm*0.104720");
    let wheel = model(
        "[model]\nkind = \"first_order\"\nfitted_to_log = true\ngain_rad_s_per_v = 9.0\ntime_constant_s = 0.06\n[supply]\nnominal_v = 8.0\n",
    );
    let holdouts = [read(&one), read(&five)];
    let mut log = read(&two);
    let outcome = analysed(&wheel, &log, &holdouts, &[]);
    assert_eq!((outcome.verdict, names(&outcome)), (Verdict::Named, vec!["dead_zone"]));
    between(outcome.effects[0].parameters["half_width_v"].value, 1.25, 1.45);
    between(outcome.holdout.fit_percent_after, 79.0, 86.0);
    log.runs.extend(read(&ten).runs.into_iter().map(|run| Run { id: 1, ..run }));
    let outcome = analysed(&wheel, &log, &holdouts, &[]);
    let found = names(&outcome);
    assert_eq!(outcome.verdict, Verdict::Named, "{found:?}");
    assert!(found.contains(&"dead_zone") && !found.contains(&"transport_delay"), "{found:?}");
    // The break-away that the sweep shows brings 84.6 %, which is not the fifth that a richer form must remove (decision 0240).
    between(outcome.holdout.fit_percent_after, 79.0, 90.0);
}
