//! A session with a servo whose tick counter wraps meanwhile.

use servo::link::protocol::{Command, FRAME_CAPACITY, Message, encode};
use trials::simulated_servo::SimulatedServo;
use truing::device::link::{Client, Wire};
use truing::text::input_error::InputError;

/// A servo that has run for five days when the session begins.
struct Old {
    servo_under_test: SimulatedServo,
    ticks: u32,
    sequence: u16,
}

impl Wire for Old {
    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError> {
        for message in self.servo_under_test.receive(outgoing) {
            let Message::Answer { to, result, .. } = message else { continue };
            let mut buffer = [0; FRAME_CAPACITY];
            self.sequence = self.sequence.wrapping_add(1);
            let answer = Message::Answer { to, tick: self.ticks, result };
            incoming.extend_from_slice(encode(self.sequence, answer, &mut buffer).expect("it fits"));
        }
        outgoing.clear();
        self.servo_under_test.tick();
        self.ticks = self.ticks.wrapping_add(1);
        Ok(())
    }
}

#[test]
fn ticks_of_a_session_grow_across_the_wrap() {
    let old = Old { servo_under_test: SimulatedServo::default(), ticks: u32::MAX - 20, sequence: 0 };
    let mut client = Client::new(Box::new(old));
    let ticks: Vec<u32> =
        (0..50).map(|_| client.command(Command::Stop, &mut |_| {}).expect("always")).collect();
    assert!(ticks.is_sorted_by(|one, next| one < next), "{ticks:?}");
    assert!(ticks[49] - ticks[0] < 200, "{ticks:?}");
}
