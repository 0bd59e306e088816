//! Motors with gravity beside friction: the counter starts anywhere, the table acts in the session, and is put back like all else.

use crate::rig::{Held, bench, bits, config, job, linear, motor};
use servo::compensate::position_load::{Harmonic, Load, PositionLoad};
use servo::link::protocol::Command;
use servo::store::AxisParameters;
use trials::host_servo::{HostServo, Outside};
use truing::device::link::Client;
use truing::device::motor::{Builtin, Drive, Motor, Reading};
use truing::device::session::{Profile, SessionResult, Start, Task};
use truing::improve::commands::improve::undone;
use truing::improve::history::{self, Entry};
use truing::improve::improving::{self, Improved};
use truing::text::input_error::InputError;

/// A weight of 1.5 V and a friction of 1 V at the winding: Kt/R is 0.045 N m/V.
const GRAVITY: &str =
    "[known.coulomb_friction]\nlevel_nm = 0.045\n[known.gravity]\nmgl_nm = 0.0675\nphase_rad = 0.4\n";
/// The counter at power-up.
const COUNTER: i32 = 123_456;

/// A motor whose counter starts somewhere.
struct Shifted(Builtin);

impl Motor for Shifted {
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError> {
        let reading = self.0.pass(drive)?;
        Ok(Reading { count: reading.count.wrapping_add(COUNTER), ..reading })
    }
}

fn held(outside: &Outside) -> Held {
    let motor = Builtin::new(&motor(GRAVITY), &config(), 3);
    Held::new(HostServo::power_up(Box::new(Shifted(motor)), config(), outside), outside)
}

/// A servo on the usual motor with these effects.
fn beside(effects: &str, outside: &Outside) -> Held {
    let motor = Builtin::new(&motor(effects), &config(), 3);
    Held::new(HostServo::power_up(Box::new(motor), config(), outside), outside)
}

/// What the loop makes of a motor with these effects, which it stores; the constant of its table, V.
fn improved(effects: &str) -> (f64, Improved) {
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    let budgeted = improving::Job { budget_s: 120.0, ..job(None, folder.path()) };
    let found = improving::run(bench(beside(effects, &outside)), budgeted, &mut |text| println!("{text}"))
        .expect("an end");
    assert!(found.improved, "{}", found.why);
    assert_eq!(bits(found.in_force), bits(*outside.stored.borrow()));
    let volt = 32_768.0 / f64::from(config().supply_nominal_v);
    (f64::from(found.in_force.expect("a set").position_load.constant()) / volt, found)
}

#[test]
fn a_motor_with_gravity_and_friction_follows_several_times_better() {
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    let held = held(&outside);
    let budgeted = improving::Job { budget_s: 120.0, ..job(None, folder.path()) };
    let found =
        improving::run(bench(held.clone()), budgeted, &mut |text| println!("{text}")).expect("an end");
    assert!(found.improved, "{}", found.why);
    found.entries.iter().for_each(|entry| println!("{:?}", entry.numbers));
    let table = found.in_force.expect("a set").position_load;
    assert!(table.is_on() && table.is_trusted() && table.terms().count() == 1, "{table:?}");
    let first = found.entries.iter().find(|entry| entry.kept).expect("an entry");
    for it in &first.trial.as_ref().expect("a trial").motions {
        assert!(it.ratio.low > 4.0, "{} {}", it.motion.name, it.ratio.text());
    }
    assert_eq!(bits(found.in_force), bits(*outside.stored.borrow()));
    // It goes on acting in this life of the servo, and waits in the next one, in which it is none.
    let bench = bench(held);
    assert_eq!(bits(bench.in_force().expect("an answer")), bits(found.in_force));
    let next = Outside { stored: outside.stored.clone(), ..Outside::default() };
    let later = crate::rig::bench(self::held(&next));
    assert_eq!(later.in_force().expect("an answer").expect("a set").position_load, PositionLoad::default());
    undone(&bench, folder.path(), Some(1)).expect("an undo");
    assert_eq!(bits(*outside.stored.borrow()), bits(None));
}

/// The drive adds 0.5 V to every command: the loops get the table's constant for it, and both sides of the friction stay alike.
#[test]
fn an_offset_beside_friction_is_held_by_the_constant_of_the_table() {
    let (constant, _) =
        improved("[known.coulomb_friction]\nlevel_nm = 0.045\n[known.voltage_offset]\noffset_v = 0.5\n");
    assert!((constant + 0.5).abs() < 0.05, "{constant} V");
}

/// No friction holds a shaft that a load of 0.5 V pulls: it is caught before the first run, goes on from where it was left, and is
/// held while the servo stores.
#[test]
fn a_shaft_that_a_load_drives_away_is_caught_and_follows() {
    let (constant, _) = improved("[known.constant_load]\ntorque_nm = 0.0225\n");
    assert!((constant.abs() - 0.5).abs() < 0.05, "{constant} V");
}

/// 0.1 V/rad beside friction, from a rest angle some turns away.
#[test]
fn a_spring_beside_friction_is_held_by_a_sine_of_many_turns() {
    let (_, found) = improved(
        "[known.coulomb_friction]\nlevel_nm = 0.045\n[known.torsional_spring]\nstiffness_nm_per_rad = 0.0045\nrest_rad = 4.0\n",
    );
    let first = found.entries.iter().find(|entry| entry.kept).expect("an entry");
    for it in &first.trial.as_ref().expect("a trial").motions {
        assert!(it.ratio.low > 2.0, "{} {}", it.motion.name, it.ratio.text());
    }
}

/// What it takes to turn against a load is no dead zone: where the other direction takes less than nothing, neither is trusted.
#[test]
fn ordinary_motion_takes_no_load_for_a_dead_zone() {
    let track = Task::Track {
        profile: Profile::Sine { amplitude_rad: 3.0, frequency_hz: 1.0, seconds: 10.0 },
        compensation: true,
    };
    let known = Task::Adopt(Box::new(linear().estimates));
    let bench = bench(beside("[known.constant_load]\ntorque_nm = 0.0225\n", &Outside::default()));
    let session = bench.session(Start::Configure(config().into()), &[known, track]);
    session.and_then(SessionResult::complete).expect("a sine");
    let learned = bench.in_force().expect("an answer").expect("a set").estimates;
    assert!(learned.dead_zone.iter().all(|side| side.trusted().is_none()), "{learned:?}");
}

/// A table acts, a line is lost in the middle of a trial: the next command puts it back, and it acts.
#[test]
fn an_interruption_puts_a_table_back_and_it_acts() {
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    let held = held(&outside);
    let scale = config().build().expect("a scale");
    let sine = Harmonic { cycles: 1, amplitude_v: 1.2, phase_rad: 0.1 };
    let table = Load { period_counts: 2048, constant_v: 0.0, harmonics: &[sine] };
    let table = table.build(&scale).expect("a table");
    let mut client = Client::new(Box::new(held.clone()));
    let known = AxisParameters { position_load: table, ..AxisParameters::new(config()) };
    client.command(Command::Restore(known), &mut |_| {}).expect("restored");
    client.command(Command::PositionLoad(table), &mut |_| {}).expect("it acts");
    outside.lost_at.set(Some(9_000));
    let ended = improving::run(bench(held.clone()), job(None, folder.path()), &mut |_| {});
    assert!(ended.is_err(), "the line was lost");
    outside.lost_at.set(None);
    let bench = bench(held.clone());
    improving::recover(&bench, folder.path(), &mut |_| {}).expect("the servo is back");
    assert_eq!(
        bits(bench.in_force().expect("an answer")),
        bits(Some(known)),
        "and it acts: one that waits is none"
    );
}

#[test]
fn an_entry_of_an_earlier_version_still_reads() {
    let folder = tempfile::tempdir().expect("a folder");
    let entry = Entry::now(Some(AxisParameters::new(config())));
    let mut json = serde_json::to_value(&entry).expect("JSON");
    json.as_object_mut().expect("an object").remove("at");
    json["before"].as_object_mut().expect("an object").remove("position_load");
    std::fs::write(folder.path().join("history.jsonl"), json.to_string() + "\n").expect("a file");
    let read = history::read(folder.path()).expect("a history");
    assert_eq!(read[0].before, entry.before);
    let error = format!("{:#}", history::read(&folder.path().join("none")).expect_err("no folder"));
    assert!(error.contains("name a folder"), "{error}");
}
