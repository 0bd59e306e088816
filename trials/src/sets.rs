//! A motor, a record of it and effects of middle size: what parameter sets in lock-step are tried on.

use servo::axis::Bridge;
use truing::gap::dataset::{Dataset, prepare};
use truing::system::effects::Parameter;
use truing::system::log::{Dynamic, Input, Run};
use truing::system::model::{self, Model};

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

/// A plain motor at 12 V.
pub fn motor() -> Model {
    model::parse("model.toml", MOTOR).expect("a whole model")
}

/// Rows that reverse and crawl: each voltage stays for `held` rows, `apart_s` seconds apart. The readings do not matter.
pub fn reversing(rows: usize, held: usize, apart_s: f64) -> Run {
    let volts = |k: usize| [3.0, -9.0, 12.0, -1.0, 0.4, -12.0, 6.0][k / held % 7];
    let t_s: Vec<f64> = (0..rows).map(|k| apart_s * k as f64).collect();
    let position = t_s.iter().map(|t| 60.0 / 7.0 * (1.0 - (7.0 * t).cos())).collect();
    Run {
        input: (0..rows).map(volts).collect(),
        bridge: vec![Bridge::Driven; rows],
        position: Some(position),
        speed: Some(t_s.iter().map(|t| 60.0 * (7.0 * t).sin()).collect()),
        t_s,
        ..Run::default()
    }
}

/// A run, ready to be compared.
pub fn ready(model: &Model, run: Run) -> Dataset {
    let log = Dynamic {
        source: "log.csv".into(),
        input: Input::Voltage,
        linear: false,
        runs: vec![run],
        names: Default::default(),
    };
    prepare(model, &log, &[] as &[Dynamic]).expect("a whole record")
}

/// A value between the bounds of an effect's parameter, in its own unit.
pub fn middle(dataset: &Dataset, parameter: &Parameter) -> f64 {
    let lowest = parameter.lower.max(0.0);
    match parameter.name {
        "periods_per_rev" => 7.0,
        "load_share" => 0.3,
        _ => (lowest + 0.2 * (parameter.upper.min(3.0) - lowest)) * dataset.scales.of(parameter.scale),
    }
}
