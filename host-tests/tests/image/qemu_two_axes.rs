//! Two axes in one image, each with a motor of its own.

use servo::axis::Bridge;
use servo::commission::Outcome;
use servo::link::capture::Trigger;
use servo::link::protocol::{Command, Message};
use servo::record::{Activity, Record};
use servo::store::{Found, LAYOUT};
use std::path::Path;
use trials::families::{Family, Options as PlantOptions, Plant, Seeds, Severity};
use trials::firmware::qemu_two_axes;
use trials::virtual_motor::VirtualMotor;
use truing::device::link::{Client, Lockstep};
use truing::device::motor::qemu::Options;

/// Motors of different families on encoders of their own; one chip, so one control rate and one PWM.
fn plants() -> [Plant; 2] {
    [(Family::G1, 400_030), (Family::G3, 400_031)].map(|(family, seed)| {
        Plant::draw(family, Severity::Nominal, Seeds::Evaluation(seed), &PlantOptions::default())
    })
}

fn power_up(plants: &[Plant; 2], flash: &Path) -> Client {
    let options = Options { flash: Some(flash.to_owned()), ..qemu_two_axes() };
    let joints = plants.iter().map(|plant| {
        let motor: Box<dyn truing::device::motor::Motor> = Box::new(VirtualMotor::new(plant));
        (motor, plant.config)
    });
    Client::new(Box::new(Lockstep::start_all(&options, joints.collect()).expect("QEMU")))
}

/// What each axis has said.
#[derive(Default)]
struct Heard {
    last: [Record; 2],
    outcomes: [Option<Outcome>; 2],
    captured: [usize; 2],
}

impl Heard {
    fn take(&mut self, message: Message) {
        let axis = message.axis().map(usize::from);
        match (axis, message) {
            (Some(axis), Message::Telemetry { record, .. }) => self.last[axis] = record,
            (Some(axis), Message::Commissioned { outcome, .. }) => self.outcomes[axis] = Some(outcome),
            (Some(axis), Message::Captured { shots, .. }) => self.captured[axis] += shots.len(),
            _ => {}
        }
    }
}

fn send(client: &mut Client, heard: &mut Heard, axis: u8, command: Command) -> Result<u32, String> {
    client.select(axis);
    client.command(command, &mut |message| heard.take(message)).map_err(|error| error.to_string())
}

fn turns(client: &mut Client, heard: &mut Heard, count: u32) {
    for _ in 0..count {
        client.turn(&mut |message| heard.take(message)).expect("a turn");
    }
}

#[test]
fn two_motors_are_commissioned_at_once_and_moved_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let flash = folder.path().join("flash.bin");
    let plants = plants();
    let (mut client, mut heard) = (power_up(&plants, &flash), Heard::default());
    assert_eq!(client.hello().expect("a hello").axes, 2);
    let must = |client: &mut Client, heard: &mut Heard, axis, command| {
        send(client, heard, axis, command).unwrap_or_else(|error| panic!("axis {axis}: {error}"))
    };
    let refused = send(&mut client, &mut heard, 2, Command::Stop).expect_err("there is no third axis");
    assert!(refused.contains("fewer axes"), "{refused}");
    for (axis, plant) in (0..).zip(&plants) {
        must(&mut client, &mut heard, axis, Command::Subscribe { every: 7 });
        must(&mut client, &mut heard, axis, Command::Configure(plant.config));
        must(&mut client, &mut heard, axis, Command::Arm);
    }
    let other_rate = servo::config::Config { tick_hz: 2 * plants[1].config.tick_hz, ..plants[1].config };
    let refused = send(&mut client, &mut heard, 1, Command::Configure(other_rate)).expect_err("one timer");
    assert!(refused.contains("share"), "{refused}");

    // Both learn at the same time.
    for axis in 0..2 {
        let commission = Command::Commission { budget_ms: 5000, seed: 1 };
        must(&mut client, &mut heard, axis, commission);
    }
    for _ in 0..30 {
        turns(&mut client, &mut heard, 500);
        if heard.outcomes.iter().all(Option::is_some) {
            break;
        }
    }
    for (axis, plant) in plants.iter().enumerate() {
        let outcome = heard.outcomes[axis].unwrap_or_else(|| panic!("axis {axis} has not ended"));
        assert_eq!(outcome.refused, None, "axis {axis}");
        let report = outcome.report(&plant.config.build().expect("a configuration"));
        let found = report.estimates.dead_zone_pos_v;
        let error = f64::from(found.value.expect("seen")) / plant.truth.dead_zone_v[0] - 1.0;
        assert!(
            found.trusted && error.abs() < 0.05,
            "axis {axis}: dead zone {:.2} % off, {found:?}",
            100.0 * error
        );
        let gain = f64::from(report.estimates.gain_rad_s_per_v.value.expect("seen"));
        let error = gain / plant.truth.gain - 1.0;
        assert!(error.abs() < 0.05, "axis {axis}: gain {:.2} % off", 100.0 * error);
    }

    // One moves, the other does not; the capture looks at the one that was asked for.
    turns(&mut client, &mut heard, 3000);
    must(
        &mut client,
        &mut heard,
        1,
        Command::CaptureArm { trigger: Trigger::Activity(Activity::Tracking), before: 100 },
    );
    turns(&mut client, &mut heard, 200);
    must(&mut client, &mut heard, 1, Command::Arm);
    let stood = heard.last[0].count;
    must(&mut client, &mut heard, 1, Command::Position(2.0));
    turns(&mut client, &mut heard, 1500);
    assert_eq!(heard.last[0].bridge, Bridge::Open);
    assert!((heard.last[0].count - stood).abs() <= 1, "axis 0 has moved");
    let target = 2.0 / std::f64::consts::TAU * f64::from(plants[1].config.counts_per_rev);
    assert!((f64::from(heard.last[1].reference_q8) / 256.0 - target).abs() < 1.0, "axis 1 is on its way");
    assert_ne!(heard.last[1].activity, Activity::Idle);
    must(&mut client, &mut heard, 0, Command::CaptureRead(0));
    turns(&mut client, &mut heard, 3);
    assert_eq!(heard.captured, [0, 5]);
    must(&mut client, &mut heard, 0, Command::Arm);
    let refused = send(&mut client, &mut heard, 0, Command::Save).expect_err("axis 1 holds");
    assert!(refused.contains("every bridge"), "{refused}");
    must(&mut client, &mut heard, 1, Command::Stop);
    assert_eq!(send(&mut client, &mut heard, 0, Command::Position(0.1)).err(), None);
    turns(&mut client, &mut heard, 20);
    assert_eq!(heard.last[0].bridge, Bridge::Driven);
    must(&mut client, &mut heard, 0, Command::Stop);
    turns(&mut client, &mut heard, 4000);

    // Both are stored in one set, and both are there after a restart.
    client.save(&mut |_| {}).expect("stored");
    client.close();
    let mut again = power_up(&plants, &flash);
    assert_eq!(again.hello().expect("a hello").stored, Found::Set { layout: LAYOUT });
    for (axis, plant) in (0..).zip(&plants) {
        again.select(axis);
        let stored = again.parameters().expect("an answer").expect("configured");
        assert_eq!(stored.config, plant.config);
        assert_eq!(
            stored.estimates.dead_zone,
            heard.outcomes[usize::from(axis)].expect("ended").estimates.dead_zone
        );
    }
}
