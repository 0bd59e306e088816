//! What an inner step of the plant costs, alone and in lock-step: `cargo run --release -p evaluation -- step-cost`.
//!
//! Shortest of some runs on one thread: whatever else the machine does can only make one longer.

use evaluation::{Page, Results};
use std::time::Instant;
use trials::sets::{middle, motor, ready, reversing};
use truing::gap::dataset::{COARSE, Compared, Dataset, Part, driven_by, lockstep};
use truing::system::effects::{
    BACKLASH, COGGING, COULOMB_FRICTION, DEAD_ZONE, Effect, FLEXIBLE_COUPLING, Form, Parameter,
    STRIBECK_FRICTION,
};
use truing::system::log::Input;
use truing::system::model::Model;
use truing::system::plant::effort;
use truing::system::plant::physics::Physics;

/// Measures nanoseconds an inner step and parameter set.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Runs of each kind, of which the shortest counts.
    #[arg(long, default_value_t = 30)]
    runs: u32,
    #[command(flatten)]
    results: Results,
}

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

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    let model = motor();
    let dataset = ready(&model, reversing(20_000, 200, 1e-3));
    page.line("| plant | one set, ns | four sets, ns a set | eight sets, ns a set |\n|---|---|---|---|");
    for (name, effect) in KINDS {
        row(&mut page, &arguments, &model, &dataset, name, effect);
    }
    page.close("none");
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
    effort::done().inner_steps
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
    let value = |p: &Parameter| match default(p) {
        Some(default) => default,
        None => change * middle(dataset, p),
    };
    let values: Vec<f64> = effect.parameters.iter().map(value).collect();
    (effect.apply)(&values, &mut plant);
    plant
}
