//! The load over the place in closed loop: gravity and cogging, a right table, one that is 5 % off, and wrong ones.

use servo::axis::Command;
use servo::axis::servo_axis::{Order, ServoAxis};
use servo::compensate::position_load::{Harmonic, Load, PositionLoad};
use servo::identify::estimate::Mechanism;
use servo::motion::referencing::Referencing;
use servo::protect::Fault;
use servo::record::Advisory;
use servo::units::Voltage;
use std::f64::consts::{PI, TAU};
use trials::bench::{Bench, Board};
use trials::families::{Cause, Family, Options, Plant, Seeds, Severity};
use trials::tracking::knowing;
use truing::params::compensation;
use truing::system::model;

/// Cycles a turn, amplitude in volts at the winding, phase in rad.
type Sine = (u16, f64, f64);

const GRAVITY: Sine = (1, 1.5, 0.7);
const COGGING: Sine = (12, 0.5, -1.1);

/// A gear motor with this load. The torque is that of the reference plant, `−A·sin(m·θ + φ)`.
fn plant(number: u32, sines: &[Sine], cause: Cause) -> Plant {
    let options = Options { cause: Some(cause), ..Options::default() };
    let mut plant = Plant::draw(Family::G3, Severity::Nominal, Seeds::Evaluation(770_000 + number), &options);
    let motor = &mut plant.motor;
    let per_volt = motor.torque_constant / motor.resistance_ohm;
    motor.gear_ratio = 1.0;
    for &(cycles, volts, phase) in sines {
        if cycles == 1 {
            (motor.load.mgl_nm, motor.load.gravity_phase) = (volts * per_volt, phase);
        } else {
            motor.load.cogging_nm = volts * per_volt;
            (motor.load.cogging_periods, motor.load.cogging_phase) = (f64::from(cycles), phase);
        }
    }
    plant
}

/// The table of this load, times `share`, its phases off by so much.
fn table(plant: &Plant, sines: &[Sine], share: f64, off: f64) -> PositionLoad {
    let sine = |&(cycles, volts, phase): &Sine| Harmonic {
        cycles,
        amplitude_v: (volts * share) as f32,
        phase_rad: (phase + off) as f32,
    };
    let harmonics: Vec<Harmonic> = sines.iter().map(sine).collect();
    let load = Load { period_counts: plant.config.counts_per_rev, constant_v: 0.0, harmonics: &harmonics };
    load.build(&plant.config.build().expect("a configuration")).expect("a table")
}

/// Rms of the position error of a sine over a third of a turn to both sides, rad.
fn track(bench: &mut Bench, plant: &Plant) -> f64 {
    let (hz, seconds) = (0.5, 8.0);
    let sine = Command::TrackSine { amplitude_rad: 2.0, frequency_hz: hz, duration_ms: 8_000 };
    bench.ask(sine).expect("feasible");
    let per_rad = f64::from(plant.config.counts_per_rev) / TAU;
    let (mut squares, mut ticks, mut number) = (0.0, 0.0, 0u32);
    bench.run(seconds, |output, _| {
        number += 1;
        if (2_000..6_000).contains(&number) {
            let error = f64::from(output.record.reference_q8) / 256.0 - f64::from(output.record.count) - 0.5;
            squares += (error / per_rad).powi(2);
            ticks += 1.0;
        }
    });
    f64::sqrt(squares / ticks)
}

/// Tracking without a table and with this one, everything else alike.
fn both(plant: &Plant, table: PositionLoad) -> [f64; 2] {
    let mut bench = knowing(plant);
    let without = track(&mut bench.clone(), plant);
    bench.ask(Command::PositionLoad(table)).expect("accepted");
    let with = track(&mut bench, plant);
    assert_eq!(bench.state.fault(), Fault::None);
    [without, with]
}

#[test]
fn a_pendulum_and_a_cogging_motor_track_several_times_better() {
    for (number, sines, least, least_off) in
        [(0, vec![GRAVITY], 10.0, 5.0), (2, vec![COGGING], 1.7, 1.4), (4, vec![GRAVITY, COGGING], 10.0, 5.0)]
    {
        for cause in [Cause::Friction, Cause::Input] {
            let plant = plant(number, &sines, cause);
            let [without, with] = both(&plant, table(&plant, &sines, 1.0, 0.0));
            assert!(without > least * with, "{sines:?} {cause:?}: {without} rad, {with} rad with the table");
            for share in [0.95, 1.05] {
                let [_, with] = both(&plant, table(&plant, &sines, share, 0.0));
                assert!(without > least_off * with, "{share} of {sines:?}: {without} rad, {with} rad");
            }
        }
    }
}

/// What a model knows becomes a table, also of a load behind a gear.
#[test]
fn the_table_of_a_model_holds_the_load_of_the_motor() {
    let gear = 4.0;
    let sines = [(1, 1.5, 0.7), (11, 0.1, -1.1)];
    let mut plant = plant(2, &sines, Cause::Friction);
    let motor = &mut plant.motor;
    motor.gear_ratio = gear;
    motor.load.mgl_nm *= gear;
    let mut model = format!(
        "schema = \"truing-model/1\"\n[model]\nkind = \"dc_motor\"\n[motor]\nR_ohm = {:?}\nKt_nm_per_a = {:?}\nJ_kgm2 = {:?}\n\
         gear_ratio = {gear:?}\n[encoder]\ncounts_per_rev = {}\n",
        motor.resistance_ohm, motor.torque_constant, motor.inertia, plant.config.counts_per_rev
    );
    let load = &motor.load;
    model += &format!(
        "[known.gravity]\nmgl_nm = {:?}\nphase_rad = {:?}\n[known.cogging]\namplitude_nm = {:?}\nperiods_per_rev = 11.0\nphase_rad = {:?}\n",
        load.mgl_nm, load.gravity_phase, load.cogging_nm, load.cogging_phase
    );
    let model = model::parse("model.toml", &model).expect("a model");
    let export = compensation::from_model(&model, &plant.config).expect("parameters");
    let table = export.params.position_load.expect("a table");
    assert_eq!(table.period_counts, 4 * plant.config.counts_per_rev);
    let [without, with] = both(&plant, table.build(&plant.config).expect("a table"));
    assert!(without > 5.0 * with, "{without} rad, {with} rad with the table of {:?}", export.remarks);
}

/// Twice the amplitude and any phase: three loads in all. The error stays what these voltages are to the stiffness of the loops.
#[test]
fn a_wrong_table_makes_the_loop_worse_and_not_unstable() {
    let sines = [(1, 1.0, 0.7), (12, 0.2, -1.1)];
    let plant = plant(2, &sines, Cause::Friction);
    let bench = knowing(&plant);
    let per_volt = bench.clone().axis.design(&mut bench.clone().state).loops.per_count() * 12.0;
    let most = 3.0 * 1.2 / f64::from(per_volt) / f64::from(plant.config.counts_per_rev) * TAU;
    for n in 0..6 {
        let mut bench = bench.clone();
        let wrong = table(&plant, &sines, 2.0, f64::from(n) * PI / 3.0);
        bench.ask(Command::PositionLoad(wrong)).expect("accepted");
        let rms = track(&mut bench, &plant);
        assert!(rms < most, "{n}: {rms} rad of {most}");
        if bench.state.fault() == Fault::None {
            let (mut low, mut high) = (f64::MAX, f64::MIN);
            bench.run(2.0, |_, _| {});
            bench.run(2.0, |_, reading| (low, high) = (low.min(reading.theta), high.max(reading.theta)));
            assert!(high - low < 0.2 * most, "{n}: it wanders from {low} to {high} rad at rest");
        }
    }
}

/// Teeth several times as steep as the loops are stiff: with their table the motor follows better, and where there are none, or others,
/// it is a bounded disturbance.
#[test]
fn a_table_that_is_steeper_than_the_loops_helps_and_does_not_swing() {
    let teeth = [(24, 1.0, -1.1)];
    for (number, sines) in [(0, &teeth[..]), (2, &teeth), (2, &[])] {
        let plant = plant(number, sines, Cause::Friction);
        let mut bench = knowing(&plant);
        let stiff = bench.axis.design(&mut bench.state).loops.per_count();
        let right = table(&plant, &teeth, 1.0, 0.0);
        assert!(right.slope() > stiff, "{} of {stiff}", right.slope());
        let without = track(&mut bench.clone(), &plant);
        for n in 0..4 {
            let mut bench = bench.clone();
            let other = table(&plant, &teeth, 1.0, f64::from(n) * PI / 2.0);
            bench.ask(Command::PositionLoad(other)).expect("accepted");
            let with = track(&mut bench, &plant);
            // Otherwise a quarter of a tooth.
            let most = if n == 0 && !sines.is_empty() { without / 4.0 } else { TAU / 96.0 };
            assert!(with < most, "{number} {n}: {with} rad of {without}");
            assert_eq!(bench.state.fault(), Fault::None);
            let (mut low, mut high) = (f64::MAX, f64::MIN);
            bench.run(2.0, |_, _| {});
            bench.run(2.0, |_, reading| (low, high) = (low.min(reading.theta), high.max(reading.theta)));
            assert!(high - low < 0.02, "{n}: it wanders from {low} to {high} rad at rest");
        }
    }
}

/// The integrator gives what the table takes over: neither voltage nor place jumps.
#[test]
fn a_table_that_comes_while_a_place_is_held_takes_over_from_the_integrator() {
    let plant = plant(0, &[GRAVITY], Cause::Friction);
    let mut bench = knowing(&plant);
    bench.ask(Command::Position(1.0)).expect("ready");
    let mut duty = 0;
    bench.run(5.0, |output, _| duty = output.duty);
    let count = bench.board.sample().count;
    bench.ask(Command::PositionLoad(table(&plant, &[GRAVITY], 1.0, 0.0))).expect("accepted");
    bench.run(0.1, |output, _| assert!((output.duty - duty).abs() <= 42, "{} from {duty}", output.duty));
    bench.ask(Command::PositionLoad(PositionLoad::default())).expect("accepted");
    bench.run(1.0, |output, _| assert!((output.duty - duty).abs() <= 42, "{} from {duty}", output.duty));
    assert!((bench.board.sample().count - count).abs() <= 1);
}

/// Without the table no dead zone is trusted. With it they are, and are right; with one 5 % short none is trusted wrongly.
#[test]
fn a_motor_with_gravity_and_cogging_becomes_trusted() {
    let sines = [(1, 1.0, 0.7), (12, 0.4, -1.1)];
    for number in [0, 1, 2, 3] {
        let mut plant = plant(number, &sines, Cause::Friction);
        plant.sensing.current = number % 2 == 0;
        for share in [0.0, 1.0, 0.95] {
            let mut bench = Bench::new(&plant);
            bench.run(0.01, |_, _| {});
            bench.ask(Command::PositionLoad(table(&plant, &sines, share, 0.0))).expect("accepted");
            bench.ask(Command::Arm).expect("no fault");
            bench.ask(Command::Commission { budget_ms: 5_000, seed: 1 }).expect("armed");
            bench.run(6.5, |_, _| {});
            let report = bench.axis.report(&bench.state).commissioning.expect("it has ended");
            let found = report.estimates;
            let zones = [found.dead_zone_pos_v, found.dead_zone_neg_v];
            for (zone, truth) in zones.iter().zip(plant.truth.dead_zone_v) {
                let value = f64::from(zone.value.unwrap_or(f32::NAN));
                if share == 0.0 {
                    assert!(!zone.trusted, "{number}: {value} V of {truth} V");
                } else if zone.trusted || share == 1.0 {
                    let within = if share == 1.0 { 0.03 } else { 0.1 };
                    assert!(zone.trusted, "{number}, {share}: {:?}", report.refused);
                    assert!(
                        (value / truth - 1.0).abs() < within,
                        "{number}, {share}: {value} V of {truth} V"
                    );
                }
            }
            assert!(share != 1.0 || found.mechanism == Mechanism::Friction, "{:?}", found.mechanism);
        }
    }
}

fn ask(joint: &mut ServoAxis, command: Command) {
    joint
        .execute(&Order::of(&command).expect("within its range"))
        .unwrap_or_else(|why| panic!("{command:?}: {why:?}"));
}

/// So many ticks; what the last record advises.
fn run(joint: &mut ServoAxis, board: &mut Board, ticks: u32) -> Advisory {
    let mut advisory = Advisory::None;
    for _ in 0..ticks {
        let output = joint.step(board.sample()).output;
        board.pass(output.bridge, output.duty);
        advisory = output.record.advisory;
    }
    advisory
}

/// What was put in force in one session waits in the next one for the reference, is then the same voltage at the same place, and
/// ends when counts may have been lost.
#[test]
fn a_stored_table_acts_once_the_reference_is_found() {
    let plant = plant(0, &[GRAVITY], Cause::Friction);
    let (mut joint, mut board) = (ServoAxis::new(), Board::new(&plant));
    ask(&mut joint, Command::Configure(plant.config));
    run(&mut joint, &mut board, 50);
    let table = table(&plant, &[GRAVITY], 1.0, 0.0);
    ask(&mut joint, Command::PositionLoad(table));
    assert_eq!(run(&mut joint, &mut board, 50), Advisory::None);
    let untold = joint.parameters().expect("configured").position_load;
    assert_eq!(untold, table, "it counts from power-up");
    // The shaft stands a third of a turn beyond zero.
    ask(&mut joint, Command::Reference(Referencing::Here { position_rad: (TAU / 3.0) as f32 }));
    let stored = joint.parameters().expect("configured");
    assert!(stored.position_load.is_absolute());
    let third = (plant.config.counts_per_rev / 3) as i32;
    let near = |a: Voltage, b: Voltage| (a.0 - b.0).abs() < 2_000;
    assert!(near(stored.position_load.voltage(third), table.voltage(0)));

    let mut next = ServoAxis::new();
    ask(&mut next, Command::Restore(stored));
    assert_eq!(run(&mut next, &mut board, 200), Advisory::PositionLoadOff);
    assert_eq!(next.parameters().expect("configured").position_load, stored.position_load);
    ask(&mut next, Command::Reference(Referencing::Here { position_rad: (TAU / 3.0) as f32 }));
    assert_eq!(run(&mut next, &mut board, 50), Advisory::None);
    next.lose_reference();
    assert_eq!(run(&mut next, &mut board, 50), Advisory::PositionLoadOff);

    // One that is not trusted, and one that is off, are kept and do not act.
    for idle in [table.trusted(false), table.switched(false)] {
        ask(&mut next, Command::PositionLoad(idle));
        assert_eq!(run(&mut next, &mut board, 50), Advisory::None);
        assert_eq!(next.parameters().expect("configured").position_load, idle);
    }
    // A restart without a reference.
    let mut later = ServoAxis::new();
    ask(&mut later, Command::Restore(servo::store::AxisParameters { position_load: table, ..stored }));
    assert_eq!(run(&mut later, &mut board, 200), Advisory::PositionLoadOff);
    // What is the same everywhere needs none, and outlives lost counts.
    let load = Load { period_counts: plant.config.counts_per_rev, constant_v: 0.4, harmonics: &[] };
    let constant = load.build(&plant.config.build().expect("a configuration")).expect("a table");
    ask(&mut later, Command::Restore(servo::store::AxisParameters { position_load: constant, ..stored }));
    assert_eq!(run(&mut later, &mut board, 200), Advisory::None);
    later.lose_reference();
    assert_eq!(run(&mut later, &mut board, 50), Advisory::None);
    assert_eq!(later.parameters().expect("configured").position_load, constant);
}
