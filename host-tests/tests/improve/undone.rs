//! What is kept, what is rolled back, and that nothing else ever happens.

use crate::rig::{DEAD_ZONE, Held, bench, bits, config, improved, job, linear, motor, power_up, text};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::axis::{Axis, Bridge};
use servo::compensate::modelled::Modelled;
use servo::compensate::position_load::PositionLoad;
use servo::identify::estimate::{Estimate, Mechanism, Standing};
use servo::link::protocol::Command;
use servo::motion::excitation::{Sweep, Waveform};
use servo::store::AxisParameters;
use servo::units::LAG_FRAC;
use std::cell::OnceCell;
use std::path::PathBuf;
use std::rc::Rc;
use trials::case_motor::{self, CaseMotor};
use trials::extent;
use trials::host_servo::{HostServo, Outside};
use truing::device::link::Client;
use truing::device::motor::{Builtin, Drive, Motor, Reading};
use truing::device::session::{Start, Task};
use truing::improve::candidate::{self, Analysed};
use truing::improve::history::{self, Entry};
use truing::improve::improving::{self, Job, Stop};
use truing::improve::recording;
use truing::improve::trial::{self, Tried};
use truing::params::compensation;
use truing::synthetic::cases::{self, Set, Spec};
use truing::system::model::{self, KT, Model};
use truing::text::input_error::InputError;

#[test]
fn a_motor_with_a_dead_zone_follows_better_and_that_is_stored() {
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    let found = improved(DEAD_ZONE, None, &outside, folder.path());
    assert!(found.improved, "{}", found.why);
    assert_eq!(bits(found.in_force), bits(*outside.stored.borrow()));
    let last = found.entries.iter().find(|entry| entry.kept).expect("an entry that was kept");
    for it in &last.trial.as_ref().expect("a trial").motions {
        assert!(it.ratio.low > 1.5, "{} {}", it.motion.name, it.ratio.text());
    }
    let bench = bench(power_up(DEAD_ZONE, &outside));
    let (number, _) =
        truing::improve::commands::improve::undone(&bench, folder.path(), None).expect("an undo");
    assert_eq!(
        bits(*outside.stored.borrow()),
        bits(None),
        "entry {number} began from an axis that knew nothing"
    );
    let told = history::text(&history::read(folder.path()).expect("a history"));
    assert!(told.contains("kept") && told.contains("was undone"), "{told}");
}

/// A drop of the bridge, which no commissioning finds: the log names it, and the servo follows the sign of the current.
#[test]
fn a_motor_behind_a_voltage_drop_follows_better() {
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    let found = improved("[known.voltage_drop]\ndrop_v = 0.4\n", None, &outside, folder.path());
    assert!(found.improved, "{}", found.why);
    let last = found.entries.iter().rfind(|entry| entry.kept).expect("an entry that was kept");
    let estimates = last.after.expect("what is in force").estimates;
    assert_eq!(estimates.mechanism, Mechanism::VoltageDrop);
    for it in &last.trial.as_ref().expect("a trial").motions {
        let least = if it.motion.name == "crawl" { 4.0 } else { 1.5 };
        assert!(it.ratio.low > least, "{} {}", it.motion.name, it.ratio.text());
    }
}

/// A gear takes an eighth of the torque beside 0.5 V of friction.
#[test]
fn friction_that_grows_with_the_torque_is_compensated() {
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    let gear = "[known.load_dependent_friction]\nlevel_nm = 0.0225\nper_motor_torque = 0.125\nper_load_torque = 0.0\n";
    let found = improved(gear, None, &outside, folder.path());
    assert!(found.improved, "{}", found.why);
    let last = found.entries.iter().rfind(|entry| entry.kept).expect("an entry that was kept");
    let share = f32::from(last.after.expect("what is in force").modelled.load_friction) / 65_536.0;
    assert!((0.1..0.15).contains(&share), "{share}");
    for it in &last.trial.as_ref().expect("a trial").motions {
        assert!(it.ratio.low > 2.0, "{} {}", it.motion.name, it.ratio.text());
    }
}

/// A winding of 20 ms beside a motor of 94 ms: with the sum of both alone the voltage comes late.
#[test]
fn a_winding_that_lags_is_fed_forward() {
    let file = text("").replace("L_h = 0.0005", "L_h = 0.04");
    let winding = model::parse("motor.toml", &file).expect("a model");
    let (known, _) = candidate::candidate(&winding, &linear(), None).expect("a set");
    let mut slow = known;
    slow.modelled.lag = 0;
    assert!(candidate::differs(&known, &slow));
    let motor = Builtin::new(&winding, &config(), 3);
    let servo = HostServo::power_up(Box::new(motor), config(), &Outside::default());
    let tried = trial::run(&mut bench(servo), [&slow, &known], f64::INFINITY);
    let Ok(Tried::Whole(trial)) = tried else { panic!("{tried:?}") };
    for it in &trial.motions {
        assert!(it.ratio.low > 2.0, "{} {}", it.motion.name, it.ratio.text());
    }
}

/// What only a model tells is all of this one: a later model without a lag or a load takes the old numbers out of force.
#[test]
fn a_model_takes_back_what_an_earlier_one_told() {
    let teeth =
        |nm: f64| format!("[known.cogging]\namplitude_nm = {nm}\nperiods_per_rev = 12.0\nphase_rad = 0.3\n");
    let beside = |effects: &str, base: &AxisParameters| {
        candidate::candidate(&motor(effects), base, None).expect("a set").0
    };
    let told = beside(&(teeth(0.02) + "[known.quadratic_drag]\ndrag_nms2 = 1e-6\n"), &linear());
    assert!(told.modelled.over_speed.drag > 0 && told.position_load.period_counts() > 0);
    let later = beside(DEAD_ZONE, &told);
    assert_eq!((later.modelled.over_speed.drag, later.position_load), (0, PositionLoad::default()));
    assert!(candidate::differs(&later, &told));
}

/// Loops that bear a table as they are stay as they are.
#[test]
fn loops_become_as_stiff_as_a_steep_table_asks() {
    let bandwidth = |nm: f64, periods: f64| {
        let teeth =
            format!("[known.cogging]\namplitude_nm = {nm}\nperiods_per_rev = {periods}\nphase_rad = 0.3\n");
        let (set, _) = candidate::candidate(&motor(&teeth), &linear(), None).expect("a set");
        let axis = Axis::from_parameters(&set).expect("within the ranges");
        let mut state = axis.start();
        axis.adopt(&mut state, &set.estimates).expect("nothing runs");
        (set.tuning.bandwidth, set.position_load.rest(axis.design(&mut state).loops.per_count()))
    };
    let usual = linear().tuning.bandwidth;
    assert_eq!(bandwidth(0.001, 12.0), (usual, 0));
    let (stiff, rest) = bandwidth(0.02, 12.0);
    assert!(stiff > 1.3 * usual && rest < 300, "{stiff} {rest}");
    // As far as lag and ticks allow.
    let (most, rest) = bandwidth(0.2, 120.0);
    assert!(most > stiff && most < 20.0 && rest > 3_000, "{most} {rest}");
}

/// Moves go beyond their targets with it, so the loop only tells it.
#[test]
fn the_play_of_a_gear_is_told_and_left_to_the_user() {
    let play = motor("[known.backlash]\ngap_rad = 0.05\n");
    let told = compensation::from_model(&play, &config()).expect("numbers").params.modelled;
    assert_eq!(told["backlash_rad"].value, 0.05, "{told:?}");
    let mut base = linear();
    base.modelled.play = 7;
    let (set, remarks) = candidate::candidate(&play, &base, None).expect("a set");
    assert_eq!(set.modelled.play, 7);
    // One that is doubted does not begin to act.
    base.modelled.doubted = u8::MAX;
    let (set, _) = candidate::candidate(&play, &base, None).expect("a set");
    assert_eq!(set.modelled.acting().play, 0);
    assert!(remarks.iter().any(|it| it.contains("identified.backlash_rad=0.05000")), "{remarks:?}");
}

/// Until a model tells the delay, protection must not take it for a shaft that does not follow; afterwards neither.
#[test]
fn a_motor_behind_a_delay_is_recorded_and_follows_better() {
    let late = "[known.transport_delay]\nseconds = 0.025\n[known.coulomb_friction]\nlevel_nm = 0.02\n";
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    let found = improved(late, None, &outside, folder.path());
    assert!(found.improved, "{}", found.why);
    let lag = found.in_force.expect("what is in force").modelled.lag;
    let seconds = f64::from(lag) / f64::from(1u32 << LAG_FRAC) / 1e3;
    assert!((0.02..0.03).contains(&seconds), "{seconds} s");
}

/// The iron saturates, which the servo cannot compensate: the gain that holds at small currents makes large motions worse, and the
/// friction is compensated beside the servo's own gain.
#[test]
fn beside_what_is_not_compensated_the_servo_goes_by_its_own_gain() {
    let iron = "[known.kt_saturation]\nknee_a = 2.0\n[known.coulomb_friction]\nlevel_nm = 0.02\n";
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    let job = Job { budget_s: 180.0, ..job(None, folder.path()) };
    let found = improving::run(bench(power_up(iron, &outside)), job, &mut |text| println!("{text}"));
    let found = found.expect("a servo that answers");
    assert!(found.improved, "{}", found.why);
    let numbers = |entry: &Entry| entry.after.expect("a candidate").estimates;
    let first = numbers(&found.entries[0]);
    let kept = numbers(found.entries.iter().rfind(|entry| entry.kept).expect("an entry that was kept"));
    assert!(kept.dead_zone == first.dead_zone && kept.time_constant != first.time_constant, "{kept:?}");
}

/// A dead zone of a third of the supply is no fault while it is recorded, whether a commissioning has found it or not; an encoder that
/// dies is one.
#[test]
fn a_recording_takes_nothing_for_a_fault_but_what_is_one() {
    let zone = "[known.dead_zone]\nhalf_width_v = 4.0\n";
    let (known, _) = candidate::candidate(&motor(zone), &linear(), None).expect("a set");
    let folder = tempfile::tempdir().expect("a folder");
    let recorded = |set: &AxisParameters, dies_after: u32| {
        let plan = recording::plan(set, 100.0, 1).expect("a scale").expect("time enough");
        let motor = Dying(Builtin::new(&motor(zone), &config(), 3), dies_after, 0);
        let mut bench = bench(HostServo::power_up(Box::new(motor), config(), &Outside::default()));
        recording::record(&mut bench, set, &plan, &folder.path().join("run.csv"))
    };
    for set in [&known, &linear()] {
        recorded(set, u32::MAX).expect("a whole recording");
    }
    for dies_after in [2_000, 6_000, 12_000] {
        let error = recorded(&known, dies_after).expect_err("a fault").to_string();
        assert!(error.contains("encoder"), "{error}");
    }
}

/// A motor whose encoder dies after so many ticks, and what it read last.
struct Dying(Builtin, u32, i32);

impl Motor for Dying {
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError> {
        self.1 = self.1.saturating_sub(1);
        let reading = self.0.pass(drive)?;
        self.2 = if self.1 == 0 { self.2 } else { reading.count };
        Ok(Reading { count: self.2, ..reading })
    }
}

/// A fault in the first motion of a trial latches; the second one is not asked for then.
#[test]
fn a_fault_ends_a_trial_with_its_name() {
    let (known, _) = candidate::candidate(&motor(DEAD_ZONE), &linear(), None).expect("a set");
    let motor = Dying(Builtin::new(&motor(DEAD_ZONE), &config(), 3), 5_000, 0);
    let servo = HostServo::power_up(Box::new(motor), config(), &Outside::default());
    let tried = trial::run(&mut bench(servo), [&known, &linear()], f64::INFINITY);
    let Ok(Tried::Faulted(_, what)) = tried else { panic!("{tried:?}") };
    assert!(what.contains("encoder"), "{what}");
}

/// Hardly any friction: the shaft turns on for seconds behind a recording, and home is where it was when the trial began.
#[test]
fn a_trial_that_begins_with_a_coasting_shaft_measures_from_its_home() {
    let mut bench = bench(power_up("", &Outside::default()));
    let waveform =
        Waveform { amplitude_v: 3.0, from_hz: 0.25, to_hz: 0.25, sweep: Sweep::Linear, duration_ms: 1000 };
    bench.session(Start::Configure(config().into()), &[Task::Excite(waveform)]).expect("an excited motor");
    let tried = trial::run(&mut bench, [&linear(), &linear()], f64::INFINITY);
    let Ok(Tried::Whole(trial)) = tried else { panic!("{tried:?}") };
    let crawl = trial.motions.iter().find(|it| it.motion.name == "crawl").expect("a crawl");
    let count = std::f64::consts::TAU / f64::from(config().counts_per_rev);
    assert!(crawl.at_floor && crawl.old_rms_rad.iter().all(|rms| *rms < 0.8 * count), "{crawl:?}");
}

#[test]
fn a_motor_with_nothing_to_gain_stays_as_it_is() {
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    // The winding takes a quarter of a tick.
    let right =
        AxisParameters { modelled: Modelled { lag: (1 << LAG_FRAC) / 4, ..Modelled::default() }, ..linear() };
    outside.stored.replace(Some(right));
    let found = improved("", None, &outside, folder.path());
    assert!(!found.improved, "{}", found.why);
    assert_ne!(found.stop, Stop::Fault, "{}", found.why);
    assert_eq!(bits(*outside.in_force.borrow()), bits(Some(right)));
    assert_eq!(bits(*outside.stored.borrow()), bits(Some(right)));
    assert_eq!(outside.bridge.get(), Bridge::Open);
}

/// The model claims a dead zone that the motor has not: its compensation would make the shaft rattle.
#[test]
fn a_candidate_that_follows_worse_is_rolled_back_bit_for_bit() {
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    outside.stored.replace(Some(linear()));
    let wrong = motor("[known.dead_zone]\nhalf_width_v = 3.0\n");
    let found = improved("", Some(wrong), &outside, folder.path());
    assert!(!found.improved, "{}", found.why);
    let tried = found.entries.iter().filter(|entry| entry.after.is_some()).count();
    assert!(tried > 0, "the candidate was tried: {}", found.why);
    assert_eq!(bits(*outside.in_force.borrow()), bits(Some(linear())));
    assert_eq!(bits(*outside.stored.borrow()), bits(Some(linear())));
}

/// Line unplugged, host killed, disk gone: stored is what was stored, or what was kept after a whole trial, and that is in force;
/// a servo that hears nothing for longer sees to it by itself, and any other is told by the next command.
#[test]
fn interruptions_at_random_instants_leave_the_old_parameters_in_force() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut unplugged = 0;
    // One search for all: what it finds is the same every time.
    let found: Rc<OnceCell<Analysed>> = Rc::default();
    for number in 0..extent::cases(50, 200) {
        let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
        outside.stored.replace(Some(linear()));
        let held = Held::new(power_up(DEAD_ZONE, &outside), &outside);
        let instant = random.random_range(0..50_000);
        let (disk, longer) = (number % 2 == 0, number % 4 == 1);
        outside.lives_on_s.set(if longer { 60 } else { 0 });
        match disk {
            true => held.loses_folder(instant, folder.path()),
            false => outside.lost_at.set(Some(instant)),
        }
        let once = Rc::clone(&found);
        let analyse = move |model: &Model, logs: &[PathBuf]| {
            Ok(once.get_or_init(|| candidate::analysed(model, logs).expect("names")).clone())
        };
        let job = Job { analyse: Box::new(analyse), ..job(None, folder.path()) };
        let ended = improving::run(bench(held.clone()), job, &mut |_| {});
        let stored = *outside.stored.borrow();
        let kept = bits(stored) != bits(Some(linear()));
        assert!(
            !kept
                || ended.is_ok()
                || history::read(folder.path()).is_ok_and(|all| all.iter().any(|it| it.kept))
                || disk
        );
        if disk || longer || ended.is_ok() {
            assert_eq!(bits(*outside.in_force.borrow()), bits(stored), "instant {instant}");
            assert_eq!(outside.bridge.get(), Bridge::Open, "instant {instant}");
        }
        if disk || ended.is_ok() {
            continue;
        }
        unplugged += 1;
        let error = format!("{:#}", ended.expect_err("the line is lost"));
        assert!(error.contains("line is lost") || error.contains("does not answer"), "{error}");
        outside.lost_at.set(None);
        let bench = bench(held);
        improving::recover(&bench, folder.path(), &mut |_| {}).expect("the servo is back");
        assert_eq!(bits(bench.in_force().expect("an answer")), bits(stored), "instant {instant}");
    }
    assert!(unplugged > extent::cases(12, 50), "{unplugged} interruptions met the loop");
}

/// The ways home of an axis between stops do not become shorter with the rest of a plan.
#[test]
fn whatever_time_is_left_a_recording_fits_or_is_not_made() {
    let free = linear();
    let mut between = free;
    between.config.travel_limit_rad = Some([-8.0, 8.0]);
    for known in [free, between] {
        let seconds =
            |left_s: f64| recording::plan(&known, left_s, 7).expect("no error").map(|plan| plan.seconds);
        let whole = seconds(1e6).expect("time enough");
        let (mut shortened, mut refused) = (0, 0);
        for share in 1..=200 {
            let left_s = whole * f64::from(share) / 200.0;
            match seconds(left_s) {
                Some(planned) => {
                    assert!(planned <= left_s, "{planned} s planned where {left_s} s are left");
                    shortened += 1;
                }
                None => refused += 1,
            }
        }
        assert!(shortened > 50 && refused > 50, "{shortened} shortened, {refused} refused");
    }
}

#[test]
fn what_is_no_number_or_out_of_range_is_refused_on_the_chip_and_on_the_host() {
    let outside = Outside::default();
    outside.stored.replace(Some(linear()));
    let mut client = Client::new(Box::new(power_up("", &outside)));
    let mut refused = |command: Command| {
        client.command(command, &mut |_| {}).expect_err("it is refused");
        assert_eq!(bits(client.parameters().expect("an answer")), bits(Some(linear())));
    };
    let mut bandwidth = linear();
    bandwidth.tuning.bandwidth = f32::NAN;
    refused(Command::Restore(bandwidth));
    let mut speed = linear();
    speed.config.rated_speed_rad_s = f32::NAN;
    refused(Command::Restore(speed));
    let mut estimates = linear().estimates;
    estimates.gain.value = i32::MAX;
    refused(Command::Adopt(estimates));
    estimates = linear().estimates;
    estimates.dead_zone[1] = Estimate { value: -1, u95: 0, standing: Standing::Trusted };
    refused(Command::Adopt(estimates));

    let mut broken = motor(DEAD_ZONE);
    broken.set_parameter(KT, f64::NAN);
    candidate::candidate(&broken, &linear(), None).expect_err("no number follows from it");
    model::parse("motor.toml", &text("[known.dead_zone]\nhalf_width_v = nan\n"))
        .expect_err("nor is it one in a file");
}

/// This motor, whose grease thins, is found to run away between two runs: the axis holds a fault that no command of the next run clears.
#[test]
fn a_fault_between_two_runs_ends_the_trial_and_not_the_command() {
    let case = cases::draw(&Spec { evaluation: true, ..Spec::new(Set::Outside) }, 14);
    let config = case_motor::config(&case);
    let (outside, folder) = (Outside::default(), tempfile::tempdir().expect("a folder"));
    let motor = CaseMotor::new(&case, 14).expect("an encoder at the motor");
    let servo = HostServo::power_up(Box::new(motor), config, &outside);
    let job = Job { setup: config.into(), budget_s: 180.0, seed: 14, ..job(None, folder.path()) };
    let found = improving::run(bench(servo), job, &mut |text| println!("{text}")).expect("an end");
    assert!(found.stop == Stop::Fault && !found.improved, "{}", found.why);
    assert!(found.entries.last().is_some_and(|entry| entry.why.starts_with("a fault ended a run")));
    assert_eq!(bits(found.in_force), bits(None));
}
