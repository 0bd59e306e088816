//! The gap workflow on data of an integrator that shares no line with the plant that fits: known truth, base
//! parameters off by their tolerance, noise. Names, parameters and the held-out gap are checked against the truth.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use servo::axis::Bridge;
use truing::gap::fit::hypothesis::{Hypothesis, Item};
use truing::gap::{self, Options};
use truing::outcome::{Grade, Outcome, Verdict};
use truing::report::{Exporter, terminal::Terminal};
use truing::synthetic::reference_plant::record::{Row, Window, simulate};
use truing::synthetic::reference_plant::state;
use truing::synthetic::reference_plant::{
    Command, Friction, Knee, Law, Motor, Simulator, Split, Tacho, Thermal, Train,
};
use truing::system::effects;
use truing::system::log::{Dynamic, Input, Run};
use truing::system::model::{self, Model};

const TICK: f64 = 1.2e-3;
const ROWS: usize = 3000;
const SIGMA: f64 = 0.4;

/// A 12 V motor with a time constant of 64 ms and a full speed of 200 rad/s.
fn motor() -> Motor {
    Motor::linear(2.0, 2e-3, 0.055, 1.0e-4, 5e-5, 12.0)
}

/// The model file of that motor with every parameter off by a few per cent.
fn nominal() -> Model {
    let text = "schema = \"truing-model/1\"\n[motor]\nR_ohm = 2.05\nL_h = 0.002\nKt_nm_per_a = 0.0539\nKe_vs_per_rad = 0.0556\n\
        J_kgm2 = 1.03e-4\nb_nms_per_rad = 4.9e-5\n[supply]\nnominal_v = 12.0\n[sensors]\nspeed = \"encoder_difference_centred\"\nspeed_window_s = 0.0048\n";
    model::parse("nominal.toml", text).unwrap()
}

/// Slow triangle, staircase, coasting, reversals and a sine, in another order and with other amplitudes for each seed.
fn protocol(seed: u64) -> Vec<Row> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let scale: f64 = rng.random_range(0.9..1.0);
    let shift: f64 = rng.random_range(0.0..1.0);
    let row = |k: usize| {
        let (piece, x) = (k * 6 / ROWS, (k * 6 % ROWS) as f64 / ROWS as f64);
        let wave = std::f64::consts::TAU * (x + shift);
        let (volts, bridge) = match (piece + seed as usize) % 6 {
            0 => (3.0 * (2.0 * wave).sin().asin(), Bridge::Driven),
            1 => ([2.0, 5.0, 9.0, 12.0, -4.0, -8.0, -12.0][(x * 7.0) as usize], Bridge::Driven),
            2 if (x % 0.5) > 0.25 => (0.0, Bridge::Open),
            2 => (if x < 0.5 { 9.0 } else { -9.0 }, Bridge::Driven),
            3 => (if ((x * 14.0) as usize).is_multiple_of(2) { 9.6 } else { -9.6 }, Bridge::Driven),
            4 => (12.0 * (3.0 * wave).sin(), Bridge::Driven),
            _ => (5.0 * (12.0 * x * wave).sin(), Bridge::Driven),
        };
        Row { t: k as f64 * TICK, command: Command::Volts(scale * volts), bridge }
    };
    (0..ROWS).map(row).collect()
}

/// A log as a rig would have written it.
fn recorded(motor: &Motor, seed: u64) -> Dynamic {
    logged(&mut Simulator::new(motor.clone(), 1e-7, seed), protocol(seed), seed)
}

/// The same of a motor that has run before.
fn logged(simulator: &mut Simulator, rows: Vec<Row>, seed: u64) -> Dynamic {
    let truth = simulate(simulator, &rows, Window { seconds: 4.0 * TICK, causal: false }, false);
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 1000);
    let noise = Normal::new(0.0, SIGMA).unwrap();
    let volts = |row: &Row| {
        if let Command::Volts(volts) = row.command { volts } else { 0.0 }
    };
    let run = Run {
        id: 0,
        t_s: rows.iter().map(|row| row.t).collect(),
        input: rows.iter().map(volts).collect(),
        bridge: rows.iter().map(|row| row.bridge).collect(),
        position: Some(truth.theta.clone()),
        speed: Some(truth.seen.iter().map(|omega| omega + noise.sample(&mut rng)).collect()),
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

fn analysed(motor: &Motor, seed: u64) -> Outcome {
    let (log, holdout) = (recorded(motor, seed), recorded(motor, seed + 1));
    gap::run(&nominal(), &log, &[holdout], &Options::default(), &|_| {}).unwrap()
}

fn names(outcome: &Outcome) -> Vec<&str> {
    outcome.effects.iter().map(|effect| effect.name.as_str()).collect()
}

/// A named parameter lies within four of its standard deviations (and 3 %) of the truth.
fn close(outcome: &Outcome, effect: &str, parameter: &str, truth: f64) {
    let found = outcome
        .effects
        .iter()
        .find(|named| named.name == effect)
        .unwrap_or_else(|| panic!("{:?}", names(outcome)));
    let value = &found.parameters[parameter];
    let allowed = 4.0 * value.std.unwrap() + 0.03 * truth.abs();
    assert!(
        (value.value - truth).abs() < allowed,
        "{parameter}: {} ± {:?}, truth {truth}",
        value.value,
        value.std
    );
}

/// The held-out gap closes to the noise, and was visible before.
fn closes(outcome: &Outcome) {
    let h = &outcome.holdout;
    assert!(h.rmse_before > 1.5 * SIGMA, "nothing to close: {h:?}");
    assert!(h.rmse_after < 1.06 * SIGMA && h.rmse_after > 0.94 * SIGMA, "{h:?}");
    assert!((h.noise_floor / SIGMA - 1.0).abs() < 0.08, "{h:?}");
}

#[test]
fn a_model_inside_its_tolerance_misses_nothing() {
    for seed in [11, 12, 13] {
        let outcome = analysed(&motor(), seed);
        assert_eq!(
            (outcome.verdict, names(&outcome).len()),
            (Verdict::NothingMissing, 0),
            "{:?}",
            names(&outcome)
        );
        assert!(outcome.holdout.rmse_after < 1.06 * SIGMA, "{:?}", outcome.holdout);
        let shift = outcome.within_tolerance.iter().find(|shift| shift.parameter == "Ke_vs_per_rad").unwrap();
        assert!(
            (shift.shift_percent - 100.0 * (0.055 / 0.0556 - 1.0)).abs() < 4.0 * shift.std_percent + 0.3,
            "{shift:?}"
        );
    }
}

/// Behind a warm-up by reversals, which a log does not hold. The model knows the law, and not how warm the winding is.
#[test]
fn a_winding_that_is_warm_when_the_log_begins_is_no_gap() {
    let hidden = Motor { thermal: Some(Thermal { rise_per_w: 0.01, time_constant_s: 2.0 }), ..motor() };
    let warmed = |seed: u64| {
        let mut simulator = Simulator::new(hidden.clone(), 1e-7, seed);
        for turn in 0..200 {
            let volts = if turn % 2 == 0 { 12.0 } else { -12.0 };
            simulator.run(Command::Volts(volts), Bridge::Driven, 0.02);
        }
        simulator.run(Command::Volts(0.0), Bridge::Driven, 0.5);
        (0.01 * simulator.state()[state::HEAT], logged(&mut simulator, protocol(seed), seed))
    };
    let ((rise, log), (_, holdout)) = (warmed(25), warmed(26));
    assert!((0.2..0.5).contains(&rise), "{rise}");
    let law = "[known.thermal_resistance]\nrise_per_w = 0.01\ntime_constant_s = 2.0\nstart_rise = 0.1\n";
    let model = model::parse("nominal.toml", &format!("{}{law}", nominal().source_text)).unwrap();
    let outcome = gap::run(&model, &log, &[holdout], &Options::default(), &|_| {}).unwrap();
    assert_eq!((outcome.verdict, names(&outcome).len()), (Verdict::NothingMissing, 0));
    assert!(outcome.holdout.rmse_after < 1.06 * SIGMA, "{:?}", outcome.holdout);
    let start = "known.thermal_resistance.start_rise";
    let shift = outcome.within_tolerance.iter().find(|shift| shift.parameter == start).unwrap();
    let found = 0.1 * (1.0 + 0.01 * shift.shift_percent);
    assert!((found / rise - 1.0).abs() < 0.1, "{found} instead of {rise}");
}

#[test]
fn a_dead_zone_and_a_limit_are_both_named() {
    let mut hidden = motor();
    hidden.drive.dead_zone_v = [0.8, 1.4];
    hidden.drive.limit_v = [7.5; 2];
    let outcome = analysed(&hidden, 21);
    let mut found = names(&outcome);
    found.sort_unstable();
    assert_eq!(found, ["dead_zone_asymmetric", "voltage_saturation"], "{:?}", outcome.verdict);
    assert_eq!(outcome.verdict, Verdict::Named);
    close(&outcome, "dead_zone_asymmetric", "pos_v", 0.8);
    close(&outcome, "dead_zone_asymmetric", "neg_v", 1.4);
    close(&outcome, "voltage_saturation", "limit_v", 7.5);
    closes(&outcome);
    assert!(!outcome.places.is_empty(), "where the gap sits is told");
}

/// A model without a resistance knows the current as the voltage that it takes: 2 A at 2 Ω.
#[test]
fn a_first_order_model_names_a_current_limit_as_a_voltage() {
    let mut hidden = motor();
    hidden.drive.current_limit_a = 2.0;
    let text = "schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\ngain_rad_s_per_v = 17.2\ntime_constant_s = 0.066\n\
        viscous_vs_per_rad = 0.0018\nelectrical_time_constant_s = 0.001\n[supply]\nnominal_v = 12.0\n[sensors]\n\
        speed = \"encoder_difference_centred\"\nspeed_window_s = 0.0048\n";
    let model = model::parse("first-order.toml", text).unwrap();
    let holdout = [recorded(&hidden, 24)];
    let outcome = gap::run(&model, &recorded(&hidden, 23), &holdout, &Options::default(), &|_| {}).unwrap();
    assert_eq!((outcome.verdict, names(&outcome)), (Verdict::Named, vec!["current_limit"]));
    let told = &outcome.effects[0].derived["limit_v"];
    assert!((told.value - 4.0).abs() < 0.12 && told.unit == "V" && told.std.is_some(), "{told:?}");
    closes(&outcome);
}

#[test]
fn friction_is_not_taken_for_a_dead_zone_nor_the_other_way_round() {
    let mut hidden = motor();
    hidden.friction.kinetic_nm = [0.02; 2];
    let outcome = analysed(&hidden, 31);
    assert_eq!((outcome.verdict, names(&outcome)), (Verdict::Named, vec!["coulomb_friction"]));
    close(&outcome, "coulomb_friction", "level_nm", 0.02);
    closes(&outcome);
    let mut hidden = motor();
    hidden.drive.dead_zone_v = [0.9; 2];
    let outcome = analysed(&hidden, 32);
    assert_eq!((outcome.verdict, names(&outcome)), (Verdict::Named, vec!["dead_zone"]));
    close(&outcome, "dead_zone", "half_width_v", 0.9);
    closes(&outcome);
}

#[test]
fn a_rounded_knee_attracts_no_second_name() {
    let mut hidden = motor();
    hidden.drive.limit_v = [8.0; 2];
    hidden.drive.limit_knee = Knee::Compression(0.15);
    let outcome = analysed(&hidden, 41);
    assert_eq!(names(&outcome), ["voltage_saturation"], "{:?}", outcome.verdict);
    close(&outcome, "voltage_saturation", "limit_v", 8.0);
}

#[test]
fn a_play_whose_teeth_throw_the_load_back_is_named() {
    let mut hidden = motor();
    let (gap_rad, share, rate) = (0.3, 0.45, 2300.0);
    let reduced = hidden.inertia * share * (1.0 - share);
    hidden.train = Train::Play {
        split: Split { inertia: share, viscous: 0.0 },
        gap_rad,
        stiffness: reduced * rate * rate,
        damping: 2.0 * 0.5 * reduced * rate,
    };
    let outcome = analysed(&hidden, 81);
    assert_eq!((outcome.verdict, names(&outcome)), (Verdict::Named, vec!["backlash"]));
    close(&outcome, "backlash", "gap_rad", gap_rad);
    close(&outcome, "backlash", "load_share", share);
    // Teeth that bounce part two simulations that differ by little: the gap closes nearly, not to the noise.
    let square = |rmse: f64| rmse * rmse - SIGMA * SIGMA;
    let h = &outcome.holdout;
    let left = square(h.rmse_after) / square(h.rmse_before);
    assert!(left < 0.03 && h.rmse_before > 5.0 * SIGMA, "{h:?}");
}

/// A motor that works against −k·(θ − rest) − cubic·(θ − rest)³.
fn sprung(k: f64, rest: f64, cubic: f64) -> Motor {
    let mut hidden = motor();
    hidden.load.law = Some(Law {
        torque: |p, theta| -p[0] * (theta - p[1]) - p[2] * (theta - p[1]).powi(3),
        parameters: vec![k, rest, cubic],
    });
    hidden
}

#[test]
fn a_return_spring_is_named_with_its_rest_angle() {
    let (k, rest) = (1.5e-3, -9.0);
    let outcome = analysed(&sprung(k, rest, 0.0), 101);
    assert_eq!((outcome.verdict, names(&outcome)), (Verdict::Named, vec!["torsional_spring"]));
    close(&outcome, "torsional_spring", "stiffness_nm_per_rad", k);
    close(&outcome, "torsional_spring", "rest_rad", rest);
    closes(&outcome);
}

#[test]
fn a_return_spring_that_stiffens_is_named_with_its_cubic_part() {
    let (k, rest, cubic) = (6e-4, 5.0, 4e-6);
    let outcome = analysed(&sprung(k, rest, cubic), 111);
    assert_eq!((outcome.verdict, names(&outcome)), (Verdict::Named, vec!["torsional_spring"]));
    close(&outcome, "torsional_spring", "stiffness_nm_per_rad", k);
    close(&outcome, "torsional_spring", "rest_rad", rest);
    close(&outcome, "torsional_spring", "cubic_nm_per_rad3", cubic);
    closes(&outcome);
}

#[test]
fn a_rectified_reading_with_an_offset_is_both() {
    let offset = 4.0;
    let hidden = Motor { tacho: Some(Tacho { rectified: true, ..Tacho::default() }), ..motor() };
    let shifted = |seed| {
        let mut log = recorded(&hidden, seed);
        let speed = log.runs[0].speed.as_mut().unwrap();
        speed.iter_mut().for_each(|reading| *reading += offset);
        log
    };
    let outcome = gap::run(&nominal(), &shifted(91), &[shifted(92)], &Options::default(), &|_| {}).unwrap();
    assert_eq!(
        (outcome.verdict, names(&outcome)),
        (Verdict::Named, vec!["sensor_rectified", "sensor_offset"])
    );
    close(&outcome, "sensor_offset", "offset", offset);
    closes(&outcome);
}

#[test]
fn a_base_parameter_that_a_further_effect_puts_right_is_dropped() {
    let hidden = Motor { inertia: 1.5 * motor().inertia, torque_knee_a: 4.0, ..motor() };
    let outcome = analysed(&hidden, 95);
    let mut named = names(&outcome);
    named.sort_unstable();
    assert_eq!((outcome.verdict, named), (Verdict::Named, vec!["inertia", "kt_saturation"]));
    closes(&outcome);
}

/// Driven by one voltage alone a friction looks like a wrong constant of the motor, and what is said says so: the gap that the constants
/// leave once they have moved, and how little of a fit the noise of one speed allows. A stop tells them apart.
#[test]
fn one_level_of_the_input_tells_no_friction_from_a_gain() {
    let hidden = Motor { friction: Friction::coulomb(0.004), ..motor() };
    for stops in [false, true] {
        let volts = |k: usize| if k < 100 || stops && k > ROWS / 2 { 0.0 } else { 9.0 };
        let row = |k| Row { t: k as f64 * TICK, command: Command::Volts(volts(k)), bridge: Bridge::Driven };
        let log = logged(&mut Simulator::new(hidden.clone(), 1e-7, 98), (0..ROWS).map(row).collect(), 98);
        let outcome = gap::run(&nominal(), &log, &[], &Options::default(), &|_| {}).unwrap();
        let said = outcome.notes.iter().any(|note| note.contains("moves under one input only, 9 V"));
        let found = if stops { Verdict::Named } else { Verdict::NothingMissing };
        assert_eq!((outcome.verdict, said), (found, !stops), "{:?} {:?}", names(&outcome), outcome.notes);
        let text = Terminal.export(&outcome).unwrap();
        for piece in ["with its numbers moved", "(the noise allows "] {
            assert_eq!(text.contains(piece), !stops, "{piece} in\n{text}");
        }
    }
}

#[test]
fn friction_that_grips_in_one_sector_is_not_named_in_confidence() {
    let hidden = Motor {
        friction: Friction {
            ripple: 0.95,
            ripple_periods: 1.0,
            ripple_phase: 1.0,
            ..Friction::coulomb(0.03)
        },
        ..motor()
    };
    let outcome = analysed(&hidden, 97);
    assert_eq!(outcome.verdict, Verdict::Unexplained, "{:?}", names(&outcome));
    let structure = &outcome.unexplained.structure;
    assert!(structure.contains("goes with the turn"), "{structure}");
}

#[test]
fn what_the_library_is_denied_is_not_explained_by_something_else_in_confidence() {
    let mut hidden = motor();
    hidden.load.periodic_nm = 0.02;
    hidden.load.periodic_hz = 3.3;
    let (log, holdout) = (recorded(&hidden, 51), recorded(&hidden, 52));
    let without = Options { without: vec!["periodic_load".into()], ..Options::default() };
    let outcome = gap::run(&nominal(), &log, &[holdout], &without, &|_| {}).unwrap();
    assert_eq!((outcome.verdict, names(&outcome).len()), (Verdict::Unexplained, 0), "{:?}", names(&outcome));
    assert!(
        outcome.unexplained.structure.contains("periodic in time at 3.3"),
        "{}",
        outcome.unexplained.structure
    );
}

#[test]
fn the_same_input_gives_the_same_result() {
    let mut hidden = motor();
    hidden.drive.dead_zone_v = [0.9; 2];
    let json = |mut outcome: Outcome| {
        outcome.runtime_s = 0.0;
        serde_json::to_string(&outcome).unwrap()
    };
    assert_eq!(json(analysed(&hidden, 61)), json(analysed(&hidden, 61)));
}

#[test]
fn unusable_logs_end_in_one_sentence() {
    let log = recorded(&motor(), 71);
    let refused = |log: &Dynamic, holdouts: &[Dynamic]| {
        gap::run(&nominal(), log, holdouts, &Options::default(), &|_| {}).unwrap_err().to_string()
    };
    assert!(refused(&log, std::slice::from_ref(&log)).contains("a copy proves nothing"));
    let mut linear = log.clone();
    linear.linear = true;
    assert!(refused(&linear, &[]).contains("mass_kg"));
    let mut silent = log.clone();
    silent.runs[0].input.fill(0.0);
    assert!(refused(&silent, &[]).contains("u_v is 0 throughout"));
    let mut still = log.clone();
    still.runs[0]
        .speed
        .as_mut()
        .unwrap()
        .iter_mut()
        .enumerate()
        .for_each(|(k, y)| *y = SIGMA * ((k * 7919) % 13) as f64 / 13.0);
    let outcome = gap::run(&nominal(), &still, &[], &Options::default(), &|_| {}).unwrap();
    assert_eq!(outcome.verdict, Verdict::InsufficientExcitation);
    let mut rpm = log;
    rpm.runs[0].speed.as_mut().unwrap().iter_mut().for_each(|y| *y *= 60.0 / std::f64::consts::TAU);
    let outcome = gap::run(&nominal(), &rpm, &[], &Options::default(), &|_| {}).unwrap();
    assert_eq!(outcome.verdict, Verdict::Data);
    assert!(outcome.data.iter().any(|fault| fault.what.contains("rpm")), "{:?}", outcome.data);
}

/// A belt: slower than the motor, where no fit that begins at a stiffer one arrives.
#[test]
fn a_coupling_softer_than_the_motor_is_named() {
    let (stiffness, share) = (0.4 * 1e-4 / (0.064 * 0.064), 0.5);
    let split = Split { inertia: share, viscous: 0.0 };
    let hidden = Motor { train: Train::Flexible { split, stiffness, damping: 3e-5 }, ..motor() };
    let outcome = analysed(&hidden, 121);
    assert_eq!((outcome.verdict, names(&outcome)), (Verdict::Named, vec!["flexible_coupling"]));
    close(&outcome, "flexible_coupling", "stiffness_nm_per_rad", stiffness);
    close(&outcome, "flexible_coupling", "load_share", share);
    closes(&outcome);
}

#[test]
fn where_the_encoder_stands_at_the_start_is_no_miss_of_the_position() {
    let mut hidden = motor();
    hidden.drive.dead_zone_v = [0.9; 2];
    let missed = |start_rad: f64| {
        let mut holdout = recorded(&hidden, 132);
        holdout.runs[0].position.as_mut().unwrap().iter_mut().for_each(|theta| *theta += start_rad);
        let log = recorded(&hidden, 131);
        gap::run(&nominal(), &log, &[holdout], &Options::default(), &|_| {}).unwrap().position.unwrap()
    };
    let (zero, far) = (missed(0.0), missed(-1183.0));
    assert!((far.rmse_before / zero.rmse_before - 1.0).abs() < 1e-6, "{far:?} instead of {zero:?}");
    assert!((far.rmse_after / zero.rmse_after - 1.0).abs() < 1e-6, "{far:?} instead of {zero:?}");
    assert!(zero.rmse_after < 0.1 * zero.rmse_before, "{zero:?}");
}

#[test]
fn a_name_that_a_hold_out_misses_stands_and_something_is_left() {
    let with = |kinetic: f64| {
        let mut hidden = motor();
        hidden.friction.kinetic_nm = [kinetic; 2];
        hidden
    };
    let (log, holdout) = (recorded(&with(0.02), 141), recorded(&with(0.0235), 142));
    let outcome = gap::run(&nominal(), &log, &[holdout], &Options::default(), &|_| {}).unwrap();
    assert_eq!((outcome.verdict, names(&outcome)), (Verdict::Named, vec!["coulomb_friction"]));
    assert_eq!(outcome.grade, Grade::NamedAndSomethingIsLeft, "{:?}", outcome.holdout);
    let h = &outcome.holdout;
    let left = (h.rmse_after / h.rmse_before).powi(2);
    assert!((outcome.unexplained.share_of_gap - left).abs() < 0.5 * left, "{:?}, {h:?}", outcome.unexplained);
}

/// The drive gives no more in the log; the hold-out shows that its sensor does.
#[test]
fn a_limit_of_the_sensor_lies_at_the_fastest_reading_of_all_records() {
    let mut hidden = motor();
    hidden.drive.limit_v = [7.0; 2];
    let (model, log, holdout) = (nominal(), recorded(&hidden, 151), recorded(&motor(), 152));
    let fastest = |record: &Dynamic| {
        record.runs[0].speed.as_ref().unwrap().iter().fold(0.0, |a: f64, b| b.abs().max(a))
    };
    assert!(fastest(&holdout) > 1.2 * fastest(&log));
    for (given, allowed) in [(vec![], fastest(&log)), (vec![&holdout], fastest(&holdout))] {
        let dataset = gap::made_ready(&model, &log, &given).unwrap();
        let limit = effects::find("speed_saturation").unwrap();
        let clamped = Hypothesis::new(&dataset, &model, vec![Item::plain(limit)]);
        let least = clamped.bounds(0).0 * dataset.scales.speed;
        assert!((0.97 * allowed..allowed).contains(&least), "{least} rad/s, and {allowed} was read");
    }
}

#[test]
fn the_steps_of_a_coarse_encoder_are_its_noise() {
    let counts = 256.0;
    let (step, window) = (std::f64::consts::TAU / counts, 4);
    let coarse = |seed: u64| {
        let mut log = recorded(&motor(), seed);
        let run = &mut log.runs[0];
        let counted: Vec<f64> =
            run.position.take().unwrap().iter().map(|theta| (theta / step).floor() * step).collect();
        let at = |k: usize| counted[k.min(ROWS - 1)];
        let span = window as f64 * TICK;
        let speed = (0..ROWS).map(|k| (at(k + window / 2) - at(k.saturating_sub(window / 2))) / span);
        run.speed = Some(speed.collect());
        log
    };
    let text = format!("{}[encoder]\ncounts_per_rev = {counts}\n", nominal().source_text);
    let model = model::parse("coarse.toml", &text).unwrap();
    let outcome = gap::run(&model, &coarse(161), &[coarse(162)], &Options::default(), &|_| {}).unwrap();
    assert_eq!((outcome.verdict, names(&outcome).len()), (Verdict::NothingMissing, 0));
    let rounded = step / (6f64.sqrt() * window as f64 * TICK);
    assert!(outcome.holdout.noise_floor > 0.999 * rounded, "{:?}, {rounded}", outcome.holdout);
}
