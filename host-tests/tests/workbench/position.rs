//! Logs whose only output is a position: a coarse one is compared itself, a fine one as a speed.

use servo::axis::Bridge;
use std::f64::consts::TAU;
use truing::gap::{self, Options};
use truing::outcome::Outcome;
use truing::system::log::{Dynamic, Input, Run};
use truing::system::model;

/// Gain, rad/s per V, time constant, s, and dry friction, V, of the motor that is played here.
const MOTOR: (f64, f64, f64) = (3.0, 0.05, 1.2);

/// A geared motor at 70 Hz whose encoder has so many counts; the voltage steps between levels that `seed` draws.
fn recorded(counts: f64, seed: u32) -> Dynamic {
    let (gain, tau, friction) = MOTOR;
    let (step_s, fine) = (0.014, 200);
    let (mut theta, mut omega, mut draw) = (0.0_f64, 0.0_f64, seed);
    let mut run = Run::default();
    for row in 0..700_u32 {
        if row % 35 == 0 {
            draw = draw.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        }
        let u = f64::from(draw >> 8) / f64::from(1_u32 << 24) * 16.0 - 8.0;
        run.t_s.push(f64::from(row) * step_s);
        run.input.push(u);
        run.position.get_or_insert_default().push((theta / TAU * counts).floor() * TAU / counts);
        for _ in 0..fine {
            let h = step_s / f64::from(fine);
            // Sticks where neither voltage nor motion overcomes the friction.
            let free = omega + h / tau * (gain * u - omega);
            let held = h / tau * gain * friction;
            omega = if free.abs() <= held { 0.0 } else { free - held * free.signum() };
            theta += h * omega;
        }
    }
    run.bridge = vec![Bridge::Driven; run.t_s.len()];
    Dynamic {
        source: format!("{seed}.csv"),
        input: Input::Voltage,
        linear: false,
        runs: vec![run],
        names: Default::default(),
    }
}

fn said(counts: f64) -> Outcome {
    let text = format!(
        "schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\nfitted_to_log = true\ngain_rad_s_per_v = 2.4\ntime_constant_s = 0.06\n[encoder]\ncounts_per_rev = {counts}\n"
    );
    let model = model::parse("model.toml", &text).unwrap();
    gap::run(&model, &recorded(counts, 71), &[recorded(counts, 72)], &Options::default(), &|_| {}).unwrap()
}

#[test]
fn a_coarse_position_is_compared_itself_and_friction_is_named() {
    let outcome = said(360.0);
    assert_eq!((outcome.holdout.signal.as_str(), outcome.gap_unit.as_str()), ("theta_rad", "rad"));
    let names: Vec<&str> = outcome.effects.iter().map(|effect| effect.name.as_str()).collect();
    assert!(matches!(names[..], ["coulomb_friction" | "dead_zone"]), "{names:?}");
    let value = outcome.effects[0].parameters.values().next().unwrap();
    let volts = outcome.effects[0].derived.get("level_v").unwrap_or(value);
    assert!((volts.value / MOTOR.2 - 1.0).abs() < 0.05, "{volts:?}");
    assert!(outcome.holdout.fit_percent_after > 98.0, "{:?}", outcome.holdout);
    assert_eq!(outcome.position, None, "it is what is compared anyhow");
    assert!(
        outcome.notes.iter().any(|note| note.contains("within windows of 0.60 s")),
        "{:?}",
        outcome.notes
    );
}

#[test]
fn a_fine_position_is_differenced_to_a_speed() {
    let outcome = said(40_000.0);
    assert_eq!(outcome.holdout.signal, "omega_rad_s");
    assert!(!outcome.effects.is_empty());
    // The second judge: where the shaft is after ten seconds in free run.
    let position = outcome.position.expect("a logged position is compared beside the speed");
    assert!(position.unit == "rad" && position.rmse_after < 0.2 * position.rmse_before, "{position:?}");
}
