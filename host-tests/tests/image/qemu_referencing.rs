//! Referencing and absolute moves through the image in QEMU, as `truing move --reference stop:… --to …` does them.

use servo::motion::referencing::Referencing;
use servo::record::Limit;
use servo::record::Referenced;
use std::cell::{Cell, OnceCell};
use std::f64::consts::TAU;
use std::rc::Rc;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::firmware::qemu;
use trials::stops::{STOP_TURNS, between_stops};
use trials::tracking::exact;
use trials::virtual_motor::VirtualMotor;
use truing::device::link::Lockstep;
use truing::device::motor::qemu::Lines;
use truing::device::motor::{Drive, Motor, Reading};
use truing::device::replay;
use truing::device::run_log::Tape;
use truing::device::session::{self, Done, SessionResult, Target, Task};
use truing::text::input_error::InputError;

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
    let [Done::Adopted, Done::Referenced(_), Done::Moved(arrival)] = result.done[..] else {
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

/// A motor with an index pulse of one count a turn.
struct Indexed {
    motor: VirtualMotor,
    counts_per_rev: i32,
    /// Set once the servo is there.
    lines: Rc<OnceCell<Rc<Cell<Lines>>>>,
}

/// The count of the pulse in each turn.
const PULSE: i32 = 17;

impl Motor for Indexed {
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError> {
        let reading = self.motor.pass(drive)?;
        if let Some(lines) = self.lines.get() {
            lines.set(Lines {
                index: reading.count.rem_euclid(self.counts_per_rev) == PULSE,
                ..Lines::default()
            });
        }
        Ok(reading)
    }
}

/// The index line through the image, and a log of it that is replayed although the line is in no sample.
#[test]
fn an_index_makes_targets_absolute_to_the_count() {
    let options = Options::default();
    let plant = Plant::draw(Family::G1, Severity::Nominal, Seeds::Evaluation(400_023), &options);
    let lines = Rc::new(OnceCell::new());
    let motor = Indexed {
        motor: VirtualMotor::new(&plant),
        counts_per_rev: plant.config.counts_per_rev as i32,
        lines: Rc::clone(&lines),
    };
    let wire = Lockstep::start(&qemu(), Box::new(motor), plant.config).expect("QEMU");
    lines.set(wire.lines()).expect("once");
    let per_rad = f64::from(plant.config.counts_per_rev) / TAU;
    let search = Task::Reference(Referencing::Index {
        // 0.3 counts a tick.
        speed_rad_s: (0.3 * f64::from(plant.config.tick_hz) / per_rad) as f32,
        position_rad: 0.25,
        reach_rad: (2.0 * TAU) as f32,
    });
    let tasks = [known(&plant), search, Task::Move(Target::To(2.0))];
    let result = session::run(Box::new(wire), plant.config, 1, &tasks, &mut |_| {}).expect("a session");
    let [Done::Adopted, Done::Referenced(_), Done::Moved(arrival)] = result.done[..] else {
        panic!("{:?}", result.done);
    };
    assert!(arrival.held, "{arrival:?}");
    let last = result.log.rows.last().expect("a log").record;
    assert_eq!(last.referenced, Referenced::Yes);
    // The pulse is called 0.25 rad: 2 rad are 1.75 rad beyond it.
    let there = f64::from(PULSE) + 1.75 * per_rad;
    assert!((f64::from(last.count) - there).abs() <= 2.5, "{} {there}", last.count);
    let tape = Tape::parse("run.csv", &result.log.to_csv(), &plant.config).expect("a tape");
    let verdict = replay::replay(&tape).expect("a replay");
    assert!(verdict.identical(), "{verdict}");
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
    assert!(arrival.held && f64::from(arrival.error_rad.abs()) < 2.5 * count, "{arrival:?}");
}
