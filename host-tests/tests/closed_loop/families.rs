//! The truth that the families promise is what their motors do.

use servo::axis::Bridge;
use trials::bench::{Bench, Board};
use trials::families::{Cause, Ceiling, Family, Imperfection, Options, Plant, Seeds, Severity};
use truing::synthetic::reference_plant::{Command, Motor, Simulator};

const FAMILIES: [Family; 4] = [Family::G1, Family::G2, Family::G3, Family::Paper];
const SEVERITIES: [Severity; 3] = [Severity::Exact, Severity::Nominal, Severity::Harsh];

fn plants(seeds: impl Fn(u32) -> Seeds, options: Options) -> impl Iterator<Item = Plant> {
    let plants = FAMILIES.into_iter().flat_map(move |family| SEVERITIES.map(|severity| (family, severity)));
    plants
        .enumerate()
        .map(move |(n, (family, severity))| Plant::draw(family, severity, seeds(n as u32), &options))
}

/// Steady speed at a terminal voltage, without what the family's truth leaves out of its definition: the sagging supply,
/// random torque, ripples, drag.
fn steady_speed(motor: &Motor, volts: f64) -> f64 {
    let mut motor = motor.clone();
    motor.drive.source_ohm = 0.0;
    motor.drive.ripple = 0.0;
    motor.drag = 0.0;
    motor.load.noise_nm = 0.0;
    motor.load.cogging_nm = 0.0;
    motor.friction.ripple = 0.0;
    let settled = 20.0 * motor.time_constant();
    let mut simulator = Simulator::new(motor, 1e-7, 0);
    simulator.run(Command::Volts(volts), Bridge::Driven, settled).omega
}

#[test]
fn dead_zone_gain_and_saturation_are_those_of_the_steady_speeds() {
    for cause in [Cause::Friction, Cause::Input] {
        let options = Options { cause: Some(cause), ..Options::default() };
        for plant in plants(Seeds::Design, options) {
            let (truth, mut slopes) = (plant.truth, [0.0; 2]);
            for (side, sign) in [(0, 1.0), (1, -1.0)] {
                // Far above the Stribeck speed, below the knee.
                let (low, high) = (truth.dead_zone_v[side] + 1.5, truth.dead_zone_v[side] + 2.5);
                let speed = |volts: f64| sign * steady_speed(&plant.motor, sign * volts);
                slopes[side] = speed(high) - speed(low);
                let dead_zone = low - speed(low) / slopes[side];
                let error = dead_zone / truth.dead_zone_v[side] - 1.0;
                assert!(error.abs() < 0.005, "{:?}: dead zone {error}", plant.truth);
                let knee = truth.saturation_v[side].expect("the families saturate");
                assert!(speed(0.98 * knee) < 0.999 * speed(knee));
                let beyond = speed((1.1 * knee).min(plant.motor.drive.supply_v));
                assert!((beyond / speed(knee) - 1.0).abs() < 1e-3, "{:?}", plant.truth);
            }
            let gain = 0.5 * (slopes[0] + slopes[1]);
            assert!((gain / truth.gain - 1.0).abs() < 0.003, "gain {gain}, {:?}", plant.truth);
            assert_eq!(truth.cause, cause);
        }
    }
}

#[test]
fn time_constant_is_the_area_above_a_small_step_response() {
    for plant in plants(Seeds::Design, Options { ceiling: Ceiling::Absent, ..Options::default() }) {
        let k = plant.motor.drive.gain[0];
        let mut motor = plant.motor.clone();
        motor.drag = 0.0;
        motor.friction = Default::default();
        motor.load = Default::default();
        motor.drive = truing::synthetic::reference_plant::Drive::ideal(motor.drive.supply_v);
        let (gain, settled) = (motor.gain(), 20.0 * motor.time_constant());
        assert!((plant.truth.gain / gain / k - 1.0).abs() < 0.031);
        let end = Simulator::new(motor, 1e-9, 0).run(Command::Volts(1.0), Bridge::Driven, settled);
        // ∫ (steady − ω) dt / steady = sum of the time constants.
        let area = settled - end.theta / end.omega;
        assert!((area / plant.truth.time_constant_s - 1.0).abs() < 1e-5, "{area} {:?}", plant.truth);
    }
}

#[test]
fn design_and_evaluation_never_share_a_plant() {
    for n in 0..50 {
        let draw = |seeds| Plant::draw(Family::G2, Severity::Harsh, seeds, &Options::default());
        assert_eq!(draw(Seeds::Design(n)), draw(Seeds::Design(n)));
        assert_eq!(draw(Seeds::Design(n)).seed >> 63, 0);
        assert_eq!(draw(Seeds::Evaluation(n)).seed >> 63, 1);
        assert_ne!(draw(Seeds::Design(n)).motor, draw(Seeds::Evaluation(n)).motor);
    }
}

#[test]
fn firmware_is_told_no_more_than_axis_toml_allows() {
    let mut hinted = 0;
    for n in 0..200 {
        let plant = Plant::draw(Family::G3, Severity::Nominal, Seeds::Design(n), &Options::default());
        let rated = f64::from(plant.config.rated_speed_rad_s) / (plant.motor.gain() * 12.0);
        assert!((0.69..1.31).contains(&rated));
        if let Some(hint) = plant.config.time_constant_hint_s.get() {
            hinted += 1;
            assert!((0.49..2.01).contains(&(f64::from(hint) / plant.truth.time_constant_s)));
        }
    }
    // Binomial(200, ½): 5 standard deviations.
    assert!((65..135).contains(&hinted), "{hinted}");
}

#[test]
fn knee_and_its_absence_can_be_asked_for() {
    let draw = |ceiling| {
        let options = Options { ceiling, ..Options::default() };
        Plant::draw(Family::G1, Severity::Nominal, Seeds::Design(3), &options).truth
    };
    assert_eq!(draw(Ceiling::Absent).saturation_v, [None, None]);
    let low = draw(Ceiling::At(0.5)).saturation_v.map(|level| level.unwrap_or(0.0));
    assert!(low.iter().all(|level| (level - 6.0).abs() < 1e-9), "{low:?}");
}

#[test]
fn every_imperfection_moves_the_motor_and_none_breaks_the_simulation() {
    let travel = |plant: &Plant| {
        let mut board = Board::new(plant);
        for k in 0..3000 {
            let duty = (2500.0 * (0.01 * f64::from(k)).sin()) as i16;
            board.sample();
            board.pass(Bridge::Driven, duty);
        }
        assert_eq!(board.simulator().overlooked(), 0);
        (board.sample().count, board.reading().theta)
    };
    for family in [Family::G1, Family::G3, Family::Paper] {
        let plain = Plant::draw(family, Severity::Nominal, Seeds::Design(1), &Options::default());
        for imperfection in Imperfection::ALL {
            let (count, theta) = travel(&plain.clone().with(imperfection));
            let seen = matches!(imperfection, Imperfection::DelayedSupply | Imperfection::QuantisedSupply);
            let sensor = matches!(imperfection, Imperfection::MissedCounts | Imperfection::PhaseError);
            // A ripple of the friction needs friction.
            let idle = imperfection == Imperfection::OutputRipple && plain.truth.cause == Cause::Input;
            let (plain_count, plain_theta) = travel(&plain);
            assert_eq!(theta == plain_theta, seen || sensor || idle, "{family:?} {imperfection:?}");
            assert!(!seen || count == plain_count);
        }
    }
}

#[test]
fn library_runs_on_the_board_at_every_control_rate() {
    for tick_hz in [1000, 10_000, 20_000] {
        for plant in plants(Seeds::Design, Options { tick_hz, ..Options::default() }) {
            let mut bench = Bench::new(&plant);
            bench.run(0.02, |output, _| assert_eq!(output.bridge, Bridge::Open));
        }
    }
}

#[test]
fn command_acts_one_tick_late_and_a_load_step_at_its_time() {
    let plant = Plant::draw(Family::G2, Severity::Exact, Seeds::Design(2), &Options::default());
    let mut board = Board::new(&plant);
    assert_eq!(board.pass(Bridge::Driven, 4000).omega, 0.0);
    assert!(board.pass(Bridge::Driven, 4000).omega > 0.0);

    let mut loaded = Board::new(&plant.clone().with_load_step(0.4995, 0.2));
    let mut plain = Board::new(&plant);
    for k in 0..1000 {
        let same = loaded.pass(Bridge::Driven, 3000).theta == plain.pass(Bridge::Driven, 3000).theta;
        assert_eq!(same, k < 499, "tick {k}");
    }
    let lost = (plain.reading().omega - loaded.reading().omega) / plant.truth.gain;
    let mean = 0.5 * (plant.truth.dead_zone_v[0] + plant.truth.dead_zone_v[1]);
    assert!((lost / (0.2 * mean) - 1.0).abs() < 0.1, "{lost} V of {mean} V");
}
