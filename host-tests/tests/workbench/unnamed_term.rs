//! What no name explains: what it depends on, and the term without a name. The logs are those of the reference plant, which shares
//! no code with the plant that fits.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use servo::axis::Bridge;
use truing::gap::{self, Options};
use truing::outcome::{Outcome, Style, Verdict};
use truing::report::{Exporter, json::Json, model_file::ModelFile, terminal::Terminal};
use truing::synthetic::reference_plant::record::{Row, Window, simulate};
use truing::synthetic::reference_plant::{Command, Law, Motor, Simulator};
use truing::system::log::{Dynamic, Input, Run};
use truing::system::model::{self, Model};

const TICK: f64 = 1.2e-3;
const ROWS: usize = 3000;
const SIGMA: f64 = 0.4;

const NOMINAL: &str = "schema = \"truing-model/1\"\n[motor]\nR_ohm = 2.05\nL_h = 0.002\nKt_nm_per_a = 0.0539\nKe_vs_per_rad = 0.0556\n\
    J_kgm2 = 1.03e-4\nb_nms_per_rad = 4.9e-5\n[supply]\nnominal_v = 12.0\n";

pub fn motor() -> Motor {
    Motor::linear(2.0, 2e-3, 0.055, 1.0e-4, 5e-5, 12.0)
}

pub fn nominal() -> Model {
    model::parse("nominal.toml", NOMINAL).unwrap()
}

/// Levels of voltage in both directions, each held for a random time.
pub fn recorded(motor: &Motor, seed: u64) -> Dynamic {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut volts, mut until) = (0.0, 0);
    let mut next = |k: usize| {
        if k >= until {
            volts = rng.random_range(-12.0..12.0);
            until = k + rng.random_range(30..250);
        }
        Row { t: k as f64 * TICK, command: Command::Volts(volts), bridge: Bridge::Driven }
    };
    let rows: Vec<Row> = (0..ROWS).map(&mut next).collect();
    let mut simulator = Simulator::new(motor.clone(), 1e-7, seed);
    let truth = simulate(&mut simulator, &rows, Window { seconds: 0.1 * TICK, causal: false }, false);
    let mut noise = ChaCha8Rng::seed_from_u64(seed + 1000);
    let normal = Normal::new(0.0, SIGMA).unwrap();
    let volts = |row: &Row| if let Command::Volts(volts) = row.command { volts } else { 0.0 };
    let run = Run {
        id: 0,
        t_s: rows.iter().map(|row| row.t).collect(),
        input: rows.iter().map(volts).collect(),
        bridge: rows.iter().map(|row| row.bridge).collect(),
        position: Some(truth.theta.clone()),
        speed: Some(truth.seen.iter().map(|omega| omega + normal.sample(&mut noise)).collect()),
        ..Run::default()
    };
    Dynamic {
        source: format!("run-{seed}.csv"),
        input: Input::Voltage,
        linear: false,
        runs: vec![run],
        names: Default::default(),
    }
}

pub fn analysed(model: &Model, log: &Dynamic, holdout: &Dynamic) -> Outcome {
    gap::run(model, log, std::slice::from_ref(holdout), &Options::default(), &|_| {}).unwrap()
}

fn extended(outcome: &Outcome) -> Model {
    let text = ModelFile { original: NOMINAL, origin: "run.csv" }.export(outcome).unwrap();
    model::parse("extended.toml", &text).unwrap()
}

/// Three teeth of a sawtooth a turn: no sine of the library, and no friction.
fn toothed() -> Motor {
    let mut hidden = motor();
    hidden.load.law = Some(Law {
        torque: |p, theta| {
            let wave = |k: f64| (k * 3.0 * theta).sin() / k;
            p[0] * (wave(1.0) + wave(2.0) + wave(3.0) + wave(4.0))
        },
        parameters: vec![0.02],
    });
    hidden
}

#[test]
fn a_torque_of_the_place_in_a_turn_is_told_added_and_simulated() {
    let without = Options { without: vec!["cogging".into(), "gravity".into()], ..Options::default() };
    let (log, holdout) = (recorded(&toothed(), 71), recorded(&toothed(), 72));
    let outcome = gap::run(&nominal(), &log, std::slice::from_ref(&holdout), &without, &|_| {}).unwrap();
    let left = &outcome.unexplained;
    assert_eq!(outcome.verdict, Verdict::Unexplained);
    assert_eq!(
        (left.depends_on.as_slice(), left.noise_like),
        (&["turn_of_motor"][..], Some(false)),
        "{}",
        left.structure
    );
    assert!(left.structure.starts_with("depends on the place within a turn"), "{}", left.structure);
    assert!(left.predicts_share.unwrap() > 0.8, "{left:?}");
    let term = left.unnamed.as_ref().unwrap();
    assert!(term.gap_after < 0.4 * term.gap_before, "{} → {}", term.gap_before, term.gap_after);
    assert_eq!(term.gap_after, outcome.holdout.rmse_after);
    // The table is the torque, within its ± and what 24 knots can follow.
    let truth =
        |angle: f64| (1..=4).map(|k| 0.02 * (f64::from(k) * 3.0 * angle).sin() / f64::from(k)).sum::<f64>();
    let mean = term.values.iter().sum::<f64>() / term.values.len() as f64;
    let off: Vec<f64> =
        term.knots[0].iter().zip(&term.values).map(|(angle, value)| value - mean - truth(*angle)).collect();
    let rms = (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
    assert!(rms < 0.006, "{rms} N m where the torque has an amplitude of 0.03: {off:?}");
    let stds: Vec<f64> = term.values_std.iter().flatten().copied().collect();
    let inside = off.iter().zip(&stds).filter(|(off, std)| off.abs() < 2.0 * **std).count();
    assert!(stds.len() == off.len() && inside >= 20, "{inside} of {} within two deviations", off.len());
    // The model file holds it, and the same program simulates it: what was left is gone, and nothing more of it is found.
    let model = extended(&outcome);
    assert_eq!(model.unnamed[0].name, "unnamed_1");
    let again = gap::run(&model, &log, &[holdout], &without, &|_| {}).unwrap();
    assert!(
        (again.holdout.rmse_before / outcome.holdout.rmse_after - 1.0).abs() < 0.02,
        "{:?}",
        again.holdout
    );
    assert!(again.effects.is_empty() && again.unexplained.unnamed.is_none(), "{:?}", again.unexplained);
}

#[test]
fn a_name_is_preferred_to_a_table_of_the_same() {
    let mut hidden = motor();
    hidden.load.cogging_nm = 0.02;
    hidden.load.cogging_periods = 3.0;
    let outcome = analysed(&nominal(), &recorded(&hidden, 73), &recorded(&hidden, 74));
    assert_eq!(outcome.effects.len(), 1, "{:?}", outcome.unexplained);
    assert_eq!((outcome.effects[0].name.as_str(), outcome.unexplained.unnamed), ("cogging", None));
}

#[test]
fn a_random_torque_is_noise_like_and_gets_no_term() {
    let mut hidden = motor();
    hidden.load.noise_nm = 0.02;
    hidden.load.noise_s = 0.1;
    let outcome = analysed(&nominal(), &recorded(&hidden, 75), &recorded(&hidden, 76));
    let left = &outcome.unexplained;
    assert_eq!((outcome.verdict, left.noise_like), (Verdict::Unexplained, Some(true)), "{left:?}");
    assert!(left.structure.starts_with("noise-like"), "{}", left.structure);
    assert!(left.depends_on.is_empty() && left.unnamed.is_none() && left.predicts_share.is_none());
    assert!(outcome.next_experiment.unwrap().why.contains("same input twice"));
}

#[test]
fn reports_tell_the_term_and_show_the_dependence() {
    let without = Options { without: vec!["cogging".into(), "gravity".into()], ..Options::default() };
    let (log, holdout) = (recorded(&toothed(), 77), recorded(&toothed(), 78));
    let outcome = gap::run(&nominal(), &log, &[holdout], &without, &|_| {}).unwrap();
    let text = Terminal.export(&outcome).unwrap();
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("unnamed_1, a term without a name: torque of up to"), "{words}");
    assert!(words.contains("+ unnamed_1"), "{words}");
    let plot = outcome.plots.iter().find(|plot| plot.title.starts_with("What is left over")).unwrap();
    let styles: Vec<Style> = plot.series.iter().map(|series| series.style).collect();
    assert_eq!(styles, [Style::Points, Style::Hollow, Style::Line], "log, held out, table");
    let json: serde_json::Value = serde_json::from_str(&Json.export(&outcome).unwrap()).unwrap();
    assert_eq!(json["unexplained"]["depends_on"], serde_json::json!(["turn_of_motor"]));
    assert_eq!(json["unexplained"]["unnamed"]["name"], "unnamed_1");
    assert!(outcome.next_experiment.unwrap().why.contains("cross every place slowly"));
}

fn complaint(section: &str) -> String {
    let text = format!("{NOMINAL}[known.unnamed_1]\n{section}");
    model::parse("model.toml", &text).unwrap_err().to_string()
}

#[test]
fn a_term_in_a_model_file_is_read_or_refused_with_its_line() {
    let good = "over = [\"speed\"]\nacts = \"torque\"\nstandstill_speed = 1.0\nspeed = [-1, 0.0, 1]\nvalues = [1, 0, -1]\n";
    let model = model::parse("model.toml", &format!("{NOMINAL}[known.unnamed_1]\n{good}")).unwrap();
    assert_eq!(model.unnamed[0].term.values, [1.0, 0.0, -1.0]);
    assert!(complaint(&good.replace("\"speed\"", "\"sped\"")).contains("the nearest is \"speed\""));
    assert!(
        complaint(&good.replace("[1, 0, -1]", "[1, 0]")).contains("holds 2 numbers; the knots ask for 3")
    );
    assert!(complaint(&good.replace("[-1, 0.0, 1]", "[-1, 2, 1]")).contains("two knots that rise"));
    assert!(complaint(&good.replace("standstill_speed = 1.0\n", "")).contains("standstill_speed is missing"));
    assert!(complaint(&good.replace("\"torque\"", "\"torqe\"")).contains("the nearest is \"torque\""));
    assert!(complaint(&format!("{good}power = 2\n")).contains("power is no known key"));
}
