//! Three logs of strangers, from the file to the verdict: what `docs/log.md` shows. The motors are simulated here, in steps of
//! 0.1 ms, with equations of this file alone.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;
use truing::files::log::look;
use truing::files::log::{self, Columns};
use truing::gap::{self, Options};
use truing::outcome::{Outcome, Verdict};
use truing::system::model::{self, Model};

/// Gain, rad/s per V, and time constant, s, of all three motors: what their model files say.
const MOTOR: (f64, f64) = (16.0, 0.09);
/// Step of the simulation, s.
const STEP_S: f64 = 1e-4;
/// Held for 0.8 s each, relative to the supply.
const LEVELS: [f64; 10] = [0.0, 1.0, -0.5, 0.25, -1.0, 0.39, 0.12, -0.12, 0.78, 0.0];

/// What is hidden, V.
#[derive(Clone, Copy)]
struct Hidden {
    coulomb_v: f64,
    dead_zone_v: f64,
}

/// One row: time, duty, speed, angle.
struct Row {
    t_s: f64,
    duty: f64,
    omega: f64,
    theta: f64,
}

fn simulated(hidden: Hidden, supply_v: f64, row_s: f64, seconds: f64) -> Vec<Row> {
    let (mut omega, mut theta) = (0.0_f64, 0.0);
    let row = |k: usize| {
        let t_s = k as f64 * row_s;
        let duty = LEVELS[(t_s / 0.8 + 1e-9) as usize % LEVELS.len()];
        let row = Row { t_s, duty, omega, theta };
        let u = duty * supply_v;
        let u = u - u.clamp(-hidden.dead_zone_v, hidden.dead_zone_v);
        for _ in 0..(row_s / STEP_S).round() as usize {
            let friction = match omega == 0.0 {
                true => u.clamp(-hidden.coulomb_v, hidden.coulomb_v),
                false => hidden.coulomb_v * omega.signum(),
            };
            let next = omega + (MOTOR.0 * (u - friction) - omega) * STEP_S / MOTOR.1;
            // Friction stops a shaft and does not turn it round.
            omega = if next * omega < 0.0 && u.abs() < hidden.coulomb_v { 0.0 } else { next };
            theta += omega * STEP_S;
        }
        row
    };
    (0..(seconds / row_s) as usize).map(row).collect()
}

fn model(more: &str) -> Model {
    let (gain, time) = MOTOR;
    let text = format!(
        "schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\ngain_rad_s_per_v = {gain:?}\ntime_constant_s = {time}\n{more}"
    );
    model::parse("model.toml", &text).unwrap()
}

/// What `truing look` proposes for these bytes, and the verdict with it.
fn judged(bytes: &[u8], model: &Model) -> (String, Outcome) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, bytes).unwrap();
    let seen = look(&path, &Columns::of("", model).unwrap()).unwrap();
    assert_eq!(seen.refused, None);
    let columns = Columns::of(&seen.columns_argument, model).unwrap();
    let log = log::read(&path, &columns).unwrap();
    let outcome = gap::run(model, &log, &[] as &[log::Log], &Options::default(), &|_| {}).unwrap();
    (seen.columns_argument, outcome)
}

/// `unit_v`: volts per unit of the outcome, which states friction as a torque of a motor with R = 1 Ω.
fn assert_named(outcome: &Outcome, name: &str, volts: f64, within: f64, unit_v: f64) {
    assert_eq!(outcome.verdict, Verdict::Named, "{:?}", outcome.effects);
    let names: Vec<&str> = outcome.effects.iter().map(|effect| effect.name.as_str()).collect();
    assert_eq!(names, [name]);
    let (_, found) = outcome.effects[0].parameters.iter().next().unwrap();
    let found = found.value * unit_v;
    assert!((found - volts).abs() < within * volts, "{found} for {volts}");
}

#[test]
fn an_arduino_s_pwm_and_rpm() {
    let rows = simulated(Hidden { coulomb_v: 0.675, dead_zone_v: 0.0 }, 12.0, 0.02, 24.0);
    let mut text = String::from("time_ms,pwm,rpm\n");
    let mut before = 0.0;
    for row in &rows {
        // 64 counts a turn; the speed is their difference over 20 ms.
        let counts = (row.theta / TAU * 64.0).round();
        let rpm = (counts - before) / 64.0 / 0.02 * 60.0;
        before = counts;
        text += &format!("{:.0},{:.0},{rpm:.1}\n", 1e3 * row.t_s, 255.0 * row.duty);
    }
    let sensors = "[sensors]\nspeed = \"encoder_difference_causal\"\nspeed_window_s = 0.02\n";
    let (columns, outcome) = judged(text.as_bytes(), &model(sensors));
    assert_eq!(columns, "duty=pwm/255,vbus_v=12");
    assert_named(&outcome, "coulomb_friction", 0.675, 0.05, MOTOR.0);
}

#[test]
fn a_german_table_in_latin_1() {
    let rows = simulated(Hidden { coulomb_v: 0.0, dead_zone_v: 1.2 }, 12.0, 0.01, 16.0);
    let mut text = String::from("Messung vom Prüfstand\r\nZeit [s];Spannung [V];Drehzahl [1/min]\r\n");
    let (mut random, noise) = (ChaCha8Rng::seed_from_u64(5), Normal::new(0.0, 2.0).unwrap());
    for row in &rows {
        let rpm = row.omega * 60.0 / TAU + noise.sample(&mut random);
        text += &format!("{:.3};{:.2};{rpm:.1}\r\n", row.t_s, 12.0 * row.duty).replace('.', ",");
    }
    let bytes: Vec<u8> = text.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap()).collect();
    let (columns, outcome) = judged(&bytes, &model(""));
    assert_eq!(columns, "");
    assert_named(&outcome, "dead_zone", 1.2, 0.02, 1.0);
}

#[test]
fn duty_and_counts() {
    let rows = simulated(Hidden { coulomb_v: 0.9, dead_zone_v: 0.0 }, 24.0, 0.001, 8.0);
    let mut text = String::from("time,duty,position\n");
    for row in &rows {
        text += &format!("{:.3},{:.4},{:.0}\n", row.t_s, row.duty, row.theta / TAU * 2048.0);
    }
    let known = model("[supply]\nnominal_v = 24.0\n[encoder]\ncounts_per_rev = 2048\n");
    let (columns, outcome) = judged(text.as_bytes(), &known);
    assert_eq!(columns, "t_s=time,theta_rev=position/2048");
    assert_named(&outcome, "coulomb_friction", 0.9, 0.02, MOTOR.0);
}
