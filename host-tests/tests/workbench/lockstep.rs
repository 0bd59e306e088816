//! Parameter sets that are simulated in lock-step get the bits that each of them gets alone.

use servo::axis::Bridge;
use trials::sets::{middle, motor, ready, reversing};
use truing::gap::dataset::{COARSE, Compared, Dataset, FINE, Part, driven_by, lockstep};
use truing::system::effects::{Effect, LIBRARY};
use truing::system::log::{Input, Run};
use truing::system::model::Model;
use truing::system::plant::features::alike;
use truing::system::plant::physics::Physics;

/// Sets beside each other: more than two registers of any processor hold, and not a multiple.
const SETS: usize = 11;

/// A record that reverses, coasts and brakes.
fn record(model: &Model, with_position: bool) -> Dataset {
    let run = reversing(700, 100, 2e-3);
    let bridge = |k: usize| match k % 211 {
        0..6 => Bridge::Open,
        6..9 => Bridge::Shorted,
        _ => Bridge::Driven,
    };
    let current = |speed: &Vec<f64>| speed.iter().map(|speed| 0.01 * speed).collect();
    let run = Run {
        bridge: (0..700).map(bridge).collect(),
        current_a: run.speed.as_ref().map(current),
        position: run.position.filter(|_| with_position),
        ..run
    };
    ready(model, run)
}

/// Plants with the effect, each with other numbers, `apart` from its neighbour's: those of the effect, the inertia and the
/// resistance.
fn plants(dataset: &Dataset, model: &Model, effect: &Effect, apart: f64) -> Vec<Physics> {
    let plant = |set: usize| {
        let change = 1.0 + apart * set as f64;
        let mut plant = driven_by(&model.kind, model.base(), Input::Voltage);
        plant.supply_v = 12.0;
        (plant.inertia, plant.resistance) = (plant.inertia / change, plant.resistance * change.sqrt());
        let values: Vec<f64> = effect.parameters.iter().map(|p| change * middle(dataset, p)).collect();
        (effect.apply)(&values, &mut plant);
        plant
    };
    (0..SETS).map(plant).collect()
}

fn bits(residuals: &[f64]) -> Vec<u64> {
    residuals.iter().map(|value| value.to_bits()).collect()
}

fn same_bits(dataset: &Dataset, plants: &[Physics], finest: f64, name: &str) {
    let starts: Vec<f64> =
        (0..plants.len()).map(|set| if set % 2 == 0 { 0.0 } else { 5.0 + set as f64 }).collect();
    let parts = [Part::A, Part::B];
    let run = &dataset.runs[0];
    let mut together = vec![Vec::new(); plants.len()];
    lockstep(&[Compared { run, starts: starts.clone() }], plants, &parts, finest, &mut together);
    for (set, plant) in plants.iter().enumerate() {
        let mut alone = [Vec::new()];
        let compared = [Compared { run, starts: vec![starts[set]] }];
        lockstep(&compared, std::slice::from_ref(plant), &parts, finest, &mut alone);
        assert!(alone[0].len() > 500 && alone[0].iter().all(|value| value.is_finite()), "{name}, set {set}");
        assert!(bits(&alone[0]) == bits(&together[set]), "{name}, set {set}: other numbers than alone");
    }
}

#[test]
fn every_effect_gives_the_same_bits_alone_and_beside_others() {
    let model = motor();
    for with_position in [true, false] {
        let dataset = record(&model, with_position);
        for effect in LIBRARY.iter().filter(|effect| effect.on_records()) {
            let plants = plants(&dataset, &model, effect, 0.013);
            for finest in [COARSE, FINE] {
                same_bits(&dataset, &plants, finest, effect.name);
            }
        }
    }
}

#[test]
fn sets_that_differ_a_little_do_advance_together() {
    let model = motor();
    let dataset = record(&model, true);
    for effect in LIBRARY.iter().filter(|effect| effect.on_records()) {
        let plants = plants(&dataset, &model, effect, 1e-4);
        let beside = plants.iter().filter(|plant| alike(&plants[0], plant)).count();
        assert!(beside >= 2, "{}: each set goes alone", effect.name);
    }
}

#[test]
fn sets_of_different_kinds_may_be_mixed() {
    let model = motor();
    let dataset = record(&model, true);
    let some = LIBRARY.iter().filter(|effect| effect.on_records());
    let mixed: Vec<Physics> =
        some.map(|effect| plants(&dataset, &model, effect, 0.013).swap_remove(1)).collect();
    same_bits(&dataset, &mixed, COARSE, "mixed");
}
