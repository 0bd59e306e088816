//! A profile from a file, streamed through the image in QEMU: as good as the chip's own sine, the same bits on the host, and
//! safe when the host dies.

use servo::link::protocol::{Command, Message};
use servo::motion::stream::Point;
use servo::optional::Optional;
use servo::record::{Activity, Advisory, Record};
use std::f64::consts::TAU;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::firmware::{compare, qemu};
use trials::virtual_motor::VirtualMotor;
use truing::device::link::{Client, Lockstep};
use truing::device::session::{Done, Profile, Task};
use truing::device::tracking::TrackJson;
use truing::servo_host::commands::profile;

const COMMISSION: Task = Task::Commission { budget_s: 5.0, seed: 1 };
const SECONDS: f64 = 4.0;

fn plant() -> Plant {
    let options = Options::default();
    Plant::draw(Family::G2, Severity::Nominal, Seeds::Evaluation(400_022), &options)
}

/// A fifth of full speed at 1 Hz, rad.
fn amplitude(plant: &Plant) -> f64 {
    0.2 * f64::from(plant.config.rated_speed_rad_s) / TAU
}

/// A sine of 1 Hz that swells and fades over a turn, 100 rows a second.
fn wanted(plant: &Plant, t: f64) -> f64 {
    let turns = t.min(SECONDS - t).clamp(0.0, 1.0);
    amplitude(plant) * turns.powi(3) * (10.0 - 15.0 * turns + 6.0 * turns * turns) * (TAU * t).sin()
}

/// The task that `--profile file:` makes of it.
fn streamed(plant: &Plant) -> Task {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("sine.csv");
    let rows = (0..=(100.0 * SECONDS) as u32).map(|row| f64::from(row) / 100.0);
    let text: String = rows.map(|t| format!("{t},{:.7}\n", wanted(plant, t))).collect();
    std::fs::write(&path, format!("t_s,theta_ref_rad\n{text}")).expect("a file");
    profile::task(&format!("file:{}", path.display()), true, &plant.config).expect("a profile")
}

#[test]
fn a_file_is_followed_as_well_as_the_chips_own_sine_and_replayed() {
    let plant = plant();
    let own = Task::Track {
        profile: Profile::Sine {
            amplitude_rad: amplitude(&plant) as f32,
            frequency_hz: 1.0,
            seconds: SECONDS as f32,
        },
        compensation: true,
    };
    let (result, verdict) = compare(&plant, &[COMMISSION, own, streamed(&plant)]).expect("a session");
    assert!(verdict.identical(), "{verdict}");
    let [_, Done::Tracked(own), Done::Tracked(streamed)] = &result.done[..] else {
        panic!("{:?}", result.done);
    };
    let [own, from_file] = [own, streamed].map(|span| TrackJson::new(&result.log, span));
    println!("{} own, {} streamed", own.position_rms_rad, from_file.position_rms_rad);
    assert!(from_file.position_rms_rad < 1.5 * own.position_rms_rad);
    assert!(own.position_rms_rad < 0.05 * amplitude(&plant) && !from_file.faulted);
    // What the chip makes of the rows is the curve behind them.
    let log = &result.log;
    let tick_hz = f64::from(log.config.tick_hz);
    let within = |tick: &u32| (streamed.start..streamed.hold).contains(tick);
    let origin = log.rows.iter().find(|row| row.tick == streamed.start).expect("a row");
    let mut worst = 0.0f64;
    for row in log.rows.iter().filter(|row| within(&row.tick)) {
        let t = f64::from(row.tick - streamed.start) / tick_hz;
        let moved = f64::from(row.record.reference_q8 - origin.record.reference_q8) / 256.0;
        worst = worst.max((log.rad(moved) - wanted(&plant, t)).abs());
    }
    let quantum = log.rad(1.0 / 256.0);
    assert!(worst < 3e-4 * amplitude(&plant) + quantum, "{worst}");
}

#[test]
fn an_axis_whose_host_dies_slows_down_holds_and_says_so() {
    let plant = plant();
    let wire = Lockstep::start(&qemu(), Box::new(VirtualMotor::new(&plant)), plant.config).expect("QEMU");
    let mut client = Client::new(Box::new(wire));
    let config = servo::config::Config {
        time_constant_hint_s: Optional::new(plant.truth.time_constant_s as f32),
        ..plant.config
    };
    let mut last = Record::default();
    let mut keep = |message| {
        if let Message::Telemetry { record, .. } = message {
            last = record;
        }
    };
    for command in [Command::Subscribe { every: 1 }, Command::Configure(config), Command::Arm] {
        client.command(command, &mut keep).expect("accepted");
    }
    for step in 1..=3 {
        let point = Point {
            position_rad: 0.05 * step as f32,
            speed_rad_s: 0.5,
            acceleration_rad_s2: None,
            ticks: 100,
        };
        client.command(Command::Stream(point), &mut keep).expect("accepted");
    }
    for _ in 0..2_000 {
        client.turn(&mut keep).expect("a turn");
    }
    assert_eq!(
        (last.activity, last.advisory, last.reference_speed_q20),
        (Activity::Holding, Advisory::StreamRanDry, 0)
    );
}
