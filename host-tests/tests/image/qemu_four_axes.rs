//! As many axes in one image as the chip can drive, each with a motor of its own: nobody gets another one's command,
//! sample or telemetry.

use servo::axis::Bridge;
use servo::link::protocol::{Command, Message};
use servo::record::{Activity, Record};
use trials::families::{Family, Options as PlantOptions, Plant, Seeds, Severity};
use trials::firmware::qemu_four_axes;
use trials::virtual_motor::VirtualMotor;
use truing::device::link::{Client, Lockstep};
use truing::device::motor::Motor;

const AXES: usize = 4;
/// Behind the dead zone, V; another one for each axis.
const VOLTS: [f32; AXES] = [3.0, -3.0, 5.0, -5.0];

fn send(client: &mut Client, last: &mut [Record; AXES], axis: u8, command: Command) {
    client.select(axis);
    client
        .command(command, &mut |message| take(last, message))
        .unwrap_or_else(|error| panic!("axis {axis}: {error}"));
}

fn take(last: &mut [Record; AXES], message: Message) {
    if let Message::Telemetry { axis, record, .. } = message {
        last[usize::from(axis)] = record;
    }
}

fn turns(client: &mut Client, last: &mut [Record; AXES], count: u32) {
    for _ in 0..count {
        client.turn(&mut |message| take(last, message)).expect("a turn");
    }
}

#[test]
fn four_motors_obey_their_own_axis() {
    let plants = [400_040, 400_041, 400_042, 400_043].map(|seed| {
        Plant::draw(Family::G1, Severity::Nominal, Seeds::Evaluation(seed), &PlantOptions::default())
    });
    let joints = plants.iter().map(|plant| {
        let motor: Box<dyn Motor> = Box::new(VirtualMotor::new(plant));
        (motor, plant.config)
    });
    let wire = Lockstep::start_all(&qemu_four_axes(), joints.collect()).expect("QEMU");
    let (mut client, mut last) = (Client::new(Box::new(wire)), [Record::default(); AXES]);
    assert_eq!(usize::from(client.hello().expect("a hello").axes), AXES);
    for (axis, plant) in (0..).zip(&plants) {
        send(&mut client, &mut last, axis, Command::Subscribe { every: 7 });
        send(&mut client, &mut last, axis, Command::Configure(plant.config));
        send(&mut client, &mut last, axis, Command::Arm);
    }
    turns(&mut client, &mut last, 20);
    let start = last.map(|record| record.count);
    for (axis, volts) in (0..).zip(VOLTS) {
        send(&mut client, &mut last, axis, Command::Voltage(volts));
    }
    turns(&mut client, &mut last, 5000);
    let ways: Vec<i32> = (0..AXES).map(|axis| last[axis].count.wrapping_sub(start[axis])).collect();
    for (axis, way) in ways.iter().enumerate() {
        assert_eq!(last[axis].activity, Activity::Driving, "axis {axis}");
        assert!(way.abs() > 100 && (*way > 0) == (VOLTS[axis] > 0.0), "axis {axis}: {ways:?}");
    }
    send(&mut client, &mut last, 2, Command::Stop);
    turns(&mut client, &mut last, 50);
    let bridges = last.map(|record| record.bridge);
    let driven = Bridge::Driven;
    assert_eq!(bridges, [driven, driven, Bridge::Open, driven]);
}
