//! Referencing and absolute moves through the image in QEMU, as `truing move --reference stop:… --to …` does them.

use host_tests::families::{Family, Plant};
use host_tests::firmware::qemu;
use host_tests::stops::{STOP_TURNS, between_stops};
use host_tests::tracking::exact;
use host_tests::virtual_motor::VirtualMotor;
use servo::record::Limit;
use servo::referencing::{Referenced, Referencing};
use std::f64::consts::TAU;
use truing::input_error::InputError;
use truing::servo_link::Lockstep;
use truing::session::{self, Done, SessionResult, Target, Task};

/// What the stop is called, rad.
const AT_STOP: f32 = -1.0;

fn run(plant: &Plant, tasks: &[Task]) -> Result<SessionResult, InputError> {
    let motor = Box::new(VirtualMotor::new(plant));
    let wire = Lockstep::start(&qemu(), motor, plant.config).expect("QEMU");
    session::run(Box::new(wire), plant.config, 1, tasks, &mut |_| {})
}

fn known(plant: &Plant) -> Task {
    Task::Adopt(Box::new(exact(plant)))
}

#[test]
fn a_stop_makes_targets_absolute() {
    let plant = between_stops(Family::G1, 11);
    let search = Task::Reference(Referencing::EndStop {
        speed_rad_s: (0.08 * plant.truth.gain * 12.0) as f32,
        position_rad: AT_STOP,
        reach_rad: (4.0 * STOP_TURNS * TAU) as f32,
        current_a: None,
    });
    let target = AT_STOP - 1.5;
    let tasks = [known(&plant), search, Task::Move(Target::To(target))];
    let result = run(&plant, &tasks).expect("a session");
    let [Done::Adopted, Done::Referenced, Done::Moved(arrival)] = result.done[..] else {
        panic!("{:?}", result.done);
    };
    assert!(arrival.held && arrival.seconds > 0.0, "{arrival:?}");
    let rows = &result.log.rows;
    let pushes = rows.iter().any(|row| row.record.limit == Limit::Push);
    assert!(pushes, "it leans on the stop");
    let last = rows.last().expect("a log");
    assert_eq!(last.record.referenced, Referenced::Yes);
    // The stop lies at +2 turns: 1.5 rad before it, within what stop and encoder give way.
    let per_rad = f64::from(plant.config.counts_per_rev) / TAU;
    let there = (STOP_TURNS * TAU - 1.5) * per_rad;
    let off = f64::from(last.record.count.wrapping_sub(result.log.zero())) - there;
    assert!(off.abs() < 8.0, "{off} counts off");
}

#[test]
fn without_a_reference_an_absolute_target_is_refused_and_a_relative_one_is_not() {
    let plant = between_stops(Family::G1, 12);
    let refused = run(&plant, &[known(&plant), Task::Move(Target::To(0.5))]).expect_err("no reference");
    assert!(refused.to_string().contains("reference"), "{refused}");
    let result = run(&plant, &[known(&plant), Task::Move(Target::By(-2.0))]).expect("a session");
    let Some(Done::Moved(arrival)) = result.done.last() else {
        panic!("{:?}", result.done);
    };
    let count = TAU / f64::from(plant.config.counts_per_rev);
    assert!(
        arrival.held && f64::from(arrival.error_rad.abs()) < 2.5 * count,
        "{arrival:?}"
    );
}
