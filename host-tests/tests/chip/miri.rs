//! The core in small doses, for the interpreter that finds undefined behaviour: `servo` itself forbids `unsafe`, what it
//! builds on does not. Under Miri: `cargo +nightly miri test --package host-tests --test chip miri::`.

use servo::axis::Bridge;
use servo::identify::estimate::{Estimate, Estimates, GAIN_FRAC, Standing, TIME_FRAC, VOLTAGE_FRAC};
use servo::link::protocol::{Command, FRAME_CAPACITY, Message, Receiver, Request, encode};
use trials::power_cut::flash::Flash;
use trials::power_cut::sets::set;
use trials::power_cut::suite::{Store, loaded, save};
use trials::simulated_servo::{SimulatedServo, config};

/// Miri takes some thousand times as long.
const SHARE: u32 = if cfg!(miri) { 1 } else { 20 };

fn send(
    servo_under_test: &mut SimulatedServo,
    number: u16,
    command: Command,
) -> Result<(), servo::link::protocol::Refusal> {
    let mut buffer = [0; FRAME_CAPACITY];
    let bytes = encode(number, Request { axis: 0, command }, &mut buffer).expect("fits");
    match servo_under_test.receive(bytes)[..] {
        [Message::Answer { to, result, .. }] if to == number => result,
        ref other => panic!("one answer to {number}: {other:?}"),
    }
}

#[test]
fn commissioning_runs() {
    let mut servo_under_test = SimulatedServo::default();
    send(&mut servo_under_test, 1, Command::Configure(config())).expect("configured");
    send(&mut servo_under_test, 2, Command::Arm).expect("armed");
    send(&mut servo_under_test, 3, Command::Commission { budget_ms: 3000, seed: 1 }).expect("runs");
    let moving = (0..120 * SHARE).any(|_| servo_under_test.tick().bridge == Bridge::Driven);
    assert!(moving, "the motor is excited");
    send(&mut servo_under_test, 4, Command::Stop).expect("stopped");
    assert_eq!(servo_under_test.tick().bridge, Bridge::Open);
}

#[test]
fn tracking_with_compensation_runs() {
    let mut servo_under_test = SimulatedServo::default();
    send(&mut servo_under_test, 1, Command::Configure(config())).expect("configured");
    send(&mut servo_under_test, 2, Command::Adopt(estimates())).expect("adopted");
    send(&mut servo_under_test, 3, Command::Arm).expect("armed");
    let sine = Command::TrackSine { amplitude_rad: 1.0, frequency_hz: 2.0, duration_ms: 1000 };
    send(&mut servo_under_test, 4, sine).expect("tracks");
    let output = servo_under_test.ticks(100 * SHARE);
    assert_eq!(output.bridge, Bridge::Driven);
    assert_ne!(output.record.reference_q8, 0);
}

fn estimates() -> Estimates {
    let trusted = |value: f64, bits: u32| Estimate {
        value: (value * f64::from(1u32 << bits)) as i32,
        u95: 1,
        standing: Standing::Trusted,
    };
    Estimates {
        dead_zone: [trusted(0.08, VOLTAGE_FRAC); 2],
        gain: trusted(1.0, GAIN_FRAC),
        time_constant: trusted(400.0, TIME_FRAC),
        ..Estimates::default()
    }
}

#[test]
fn every_tick_travels_over_the_link() {
    let mut servo_under_test = SimulatedServo::driving();
    let mut receiver = Receiver::<Message>::new();
    for sequence in 0..10 {
        let output = servo_under_test.tick();
        let message =
            Message::Telemetry { axis: 0, tick: u32::from(sequence), cost: 0, record: output.record };
        let mut buffer = [0; FRAME_CAPACITY];
        let bytes = encode(sequence, &message, &mut buffer).expect("fits").to_vec();
        let frame = bytes.iter().find_map(|&byte| receiver.push(byte)).expect("whole").expect("intact");
        assert_eq!((frame.sequence, frame.body), (sequence, message));
    }
}

#[test]
fn parameters_are_stored_and_survive_a_cut() {
    let mut store = Store::<4096>::new(Flash::new(1), 0);
    assert_eq!(loaded(&mut store), None);
    save(&mut store, &set(1)).expect("saves");
    store.flash().cut(100, 3, 5);
    save(&mut store, &set(2)).expect_err("the power was cut");
    assert!(store.flash().reboot());
    assert_eq!(loaded(&mut Store::<4096>::new(store.flash().clone(), 0)), Some(set(1)));
}
