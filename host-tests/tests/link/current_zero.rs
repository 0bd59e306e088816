//! The zero of the current sensor, as joint and host meet it: nothing is armed before it is known or the wait is over.

use servo::axis::Sample;
use servo::config::{ConfigError, Field};
use servo::link::protocol::{Command, FRAME_CAPACITY, Refusal, encode};
use trials::simulated_servo::{self, SimulatedServo};
use truing::device::link::{Client, Wire, current_text, range_text};
use truing::text::input_error::InputError;

#[test]
fn an_axis_cannot_be_armed_while_the_zero_is_looked_for() {
    let mut servo_under_test = SimulatedServo::default();
    let sought = Err(Refusal::CurrentZeroSought);
    servo_under_test.world.current_raw = Sample::CURRENT_ZERO_SOUGHT;
    servo_under_test.order(Command::Configure(simulated_servo::config())).expect("a good one");
    servo_under_test.tick();
    assert_eq!(servo_under_test.order(Command::Arm), sought);
    assert_eq!(servo_under_test.order(Command::Stop), Ok(()));
    for over in [
        Sample::CURRENT_ZERO_UNSTEADY,
        Sample::CURRENT_ZERO_OUTSIDE,
        Sample::CURRENT_ZERO_UNSEEN,
        Sample::CURRENT_NOT_SENSED,
        0,
    ] {
        servo_under_test.world.current_raw = Sample::CURRENT_ZERO_SOUGHT;
        servo_under_test.tick();
        assert_eq!(servo_under_test.order(Command::Arm), sought);
        servo_under_test.world.current_raw = over;
        servo_under_test.tick();
        assert_eq!(servo_under_test.order(Command::Arm), Ok(()), "{over}");
    }
}

/// A servo_under_test at the end of a wire, with a sensor that knows its zero after some ticks.
struct Line {
    servo_under_test: SimulatedServo,
    left: u32,
    sequence: u16,
}

impl Wire for Line {
    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError> {
        self.left = self.left.saturating_sub(1);
        self.servo_under_test.world.current_raw = match self.left {
            0 => 0,
            _ => Sample::CURRENT_ZERO_SOUGHT,
        };
        for message in self.servo_under_test.receive(outgoing) {
            let mut buffer = [0; FRAME_CAPACITY];
            self.sequence = self.sequence.wrapping_add(1);
            incoming.extend_from_slice(encode(self.sequence, message, &mut buffer).expect("it fits"));
        }
        outgoing.clear();
        self.servo_under_test.tick();
        Ok(())
    }
}

#[test]
fn the_host_waits_for_the_zero_before_it_arms() {
    let line = Line { servo_under_test: SimulatedServo::default(), left: 1000, sequence: 0 };
    let mut client = Client::new(Box::new(line));
    let mut tell = |command| client.command(command, &mut |_| {});
    tell(Command::Configure(simulated_servo::config())).expect("configured");
    let tick = tell(Command::Arm).expect("armed");
    assert!((999..1100).contains(&tick), "armed in tick {tick}");
}

#[test]
fn a_sensor_without_zero_is_told_with_its_remedy() {
    for (mark, word) in [
        (Sample::CURRENT_ZERO_SOUGHT, "still looked for"),
        (Sample::CURRENT_ZERO_UNSTEADY, "spread"),
        (Sample::CURRENT_ZERO_OUTSIDE, "connected"),
        (Sample::CURRENT_ZERO_UNSEEN, "stop the servo"),
    ] {
        assert!(current_text(mark).expect("a reason").contains(word));
    }
    assert_eq!(current_text(Sample::CURRENT_NOT_SENSED), None);
    assert_eq!(current_text(0), None);
}

#[test]
fn a_limit_that_cannot_act_is_refused_in_words() {
    let refused = |maximum| ConfigError { field: Field::CurrentLimit, minimum: 0.0, maximum };
    assert_eq!(range_text(&refused(2.9)), "limits.current_a must lie between 0 and 2.9");
    assert!(range_text(&refused(0.0)).contains("does not sense the current"));
}
