//! What an inner step of the plant costs, alone and in lock-step: `cargo run --release -p evaluation --bin step_cost`.
//!
//! Shortest of some runs on one thread: whatever else the machine does can only make one longer.

use anyhow::Result;
use clap::Parser;
use evaluation::{Page, Results};
use servo::axis::Bridge;
use std::time::Instant;
use truing::gap::dataset::{Compared, Dataset, Part, driven_by, lockstep, prepare};
use truing::gap::effort;
use truing::gap::fit::COARSE;
use truing::system::effects::{
    BACKLASH, COGGING, COULOMB_FRICTION, DEAD_ZONE, Effect, FLEXIBLE_COUPLING, Form, Parameter,
    STRIBECK_FRICTION,
};
use truing::system::log::{Dynamic, Input, Run};
use truing::system::model::{self, Model};
use truing::system::plant::physics::Physics;

/// Measures nanoseconds an inner step and parameter set.
#[derive(Parser, Debug)]
struct Arguments {
    /// Runs of each kind, of which the shortest counts.
    #[arg(long, default_value_t = 30)]
    runs: u32,
    #[command(flatten)]
    results: Results,
}

const MOTOR: &str = r#"
schema = "truing-model/1"
[model]
kind = "dc_motor"
[motor]
R_ohm = 1.5
L_h = 0.001
Kt_nm_per_a = 0.05
Ke_vs_per_rad = 0.05
J_kgm2 = 1.2e-4
b_nms_per_rad = 3e-5
[supply]
nominal_v = 12.0
"#;

/// Plants: what the table calls them, the effect that makes them, and the places of its parameters between their bounds.
const KINDS: [(&str, Option<&'static Effect>); 7] = [
    ("plain motor", None),
    ("dead zone", Some(&DEAD_ZONE)),
    ("dry friction", Some(&COULOMB_FRICTION)),
    ("friction that falls with speed", Some(&STRIBECK_FRICTION)),
    ("torque that depends on the place", Some(&COGGING)),
    ("two bodies, spring", Some(&FLEXIBLE_COUPLING)),
    ("two bodies, teeth", Some(&BACKLASH)),
];

/// Sets in lock-step.
const SETS: [usize; 3] = [1, 4, 8];

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let mut page = arguments.results.page();
    let model = motor()?;
    let dataset = record(&model).map_err(|error| anyhow::anyhow!("{error}"))?;
    page.line("| plant | one set, ns | four sets, ns a set | eight sets, ns a set |\n|---|---|---|---|");
    for (name, effect) in KINDS {
        row(&mut page, &arguments, &model, &dataset, name, effect);
    }
    page.close("none");
    Ok(())
}

fn row(
    page: &mut Page,
    arguments: &Arguments,
    model: &Model,
    dataset: &Dataset,
    name: &str,
    effect: Option<&'static Effect>,
) {
    let costs = SETS.map(|sets| {
        let plants: Vec<Physics> = (0..sets).map(|set| plant(dataset, model, effect, set)).collect();
        nanoseconds(dataset, &plants, arguments.runs)
    });
    let [one, four, eight] = costs;
    page.line(format_args!("| {name} | {one:.1} | {four:.1} | {eight:.1} |"));
}

/// Of the shortest run, a step and set.
fn nanoseconds(dataset: &Dataset, plants: &[Physics], runs: u32) -> f64 {
    let compared = [Compared { run: &dataset.runs[0], starts: vec![0.0; plants.len()] }];
    let mut residuals = vec![Vec::new(); plants.len()];
    let mut shortest = f64::INFINITY;
    for _ in 0..runs {
        residuals.iter_mut().for_each(Vec::clear);
        let before = steps();
        let begin = Instant::now();
        lockstep(&compared, plants, &[Part::A, Part::B], COARSE, &mut residuals);
        let taken = begin.elapsed().as_secs_f64();
        shortest = shortest.min(1e9 * taken / (steps() - before) as f64);
    }
    shortest
}

/// Inner steps of this process so far.
fn steps() -> u64 {
    effort::spent().iter().map(|spent| spent.work.inner_steps).sum()
}

fn motor() -> Result<Model> {
    let path = std::env::temp_dir().join(format!("truing-step-cost-{}.toml", std::process::id()));
    std::fs::write(&path, MOTOR)?;
    let model = model::read(&path);
    std::fs::remove_file(&path)?;
    model.map_err(|error| anyhow::anyhow!("{error}"))
}

/// 20,000 rows at 1 kHz that reverse and crawl. Their readings do not matter here.
fn record(model: &Model) -> Result<Dataset, impl std::fmt::Display + use<>> {
    let rows = 20_000;
    let volts = |k: usize| [3.0, -9.0, 12.0, -1.0, 0.4, -12.0, 6.0][k / 200 % 7];
    let t_s: Vec<f64> = (0..rows).map(|k| 1e-3 * k as f64).collect();
    let speed: Vec<f64> = t_s.iter().map(|t| 60.0 * (7.0 * t).sin()).collect();
    let position = t_s.iter().map(|t| 60.0 / 7.0 * (1.0 - (7.0 * t).cos())).collect();
    let run = Run {
        input: (0..rows).map(volts).collect(),
        bridge: vec![Bridge::Driven; rows],
        position: Some(position),
        speed: Some(speed),
        t_s,
        ..Run::default()
    };
    let log = Dynamic { source: "log.csv".into(), input: Input::Voltage, linear: false, runs: vec![run] };
    prepare(model, &log, &[] as &[Dynamic])
}

/// A plant with an effect of middle size. Sets differ by a little, so that they advance together.
fn plant(dataset: &Dataset, model: &Model, effect: Option<&'static Effect>, set: usize) -> Physics {
    let change = 1.0 + 1e-5 * set as f64;
    let mut plant = driven_by(&model.kind, model.base(), Input::Voltage);
    plant.supply_v = 12.0;
    plant.resistance *= change;
    let Some(effect) = effect else {
        return plant;
    };
    // Plain forms, but of what is rich as a whole.
    let default = |p: &Parameter| p.default.filter(|_| effect.form == Form::Plain);
    let middle = |p: &Parameter| match p.name {
        _ if default(p).is_some() => p.default.unwrap_or_default() / change,
        "periods_per_rev" => 7.0,
        "load_share" => 0.3,
        _ => (p.lower.max(0.0) + 0.2 * (p.upper.min(3.0) - p.lower.max(0.0))) * dataset.scales.of(p.scale),
    };
    let values: Vec<f64> = effect.parameters.iter().map(|p| change * middle(p)).collect();
    (effect.apply)(&values, &mut plant);
    plant
}
