//! Bytes, ticks and strange samples in any order; what must hold after each of them.
//!
//! The fuzzer writes noise as it likes, and frames of which it chooses number and content while checksum and framing are
//! made right here, so that it gets past the checksum and into commands, axis and commissioning.

#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use servo::axis::{Bridge, Sample};
use servo::protocol::VERSION;

#[path = "../../src/desk.rs"]
mod desk;
use desk::Desk;

#[derive(Arbitrary, Debug)]
enum Step {
    /// Bytes as they come.
    Noise(Vec<u8>),
    /// A frame with right framing and checksum, and any content.
    Frame { version_off: u8, sequence: u16, body: Vec<u8> },
    /// The same bytes once more.
    Again,
    /// Time passes.
    Run(u8),
    /// Much time passes.
    RunLong(u8),
    /// The board reads something else from now on.
    World { vbus_raw: Option<u16>, current_raw: Option<i16> },
    /// The encoder jumps.
    Jump(i32),
}

/// Ticks that one input may use: two seconds.
const TICKS: u32 = 20_000;

fuzz_target!(|input: (bool, Vec<Step>)| {
    let (driving, steps) = input;
    let mut desk = if driving { Desk::driving() } else { Desk::default() };
    let (mut left, mut last) = (TICKS, Vec::new());
    for step in steps {
        match step {
            Step::Noise(bytes) => receive(&mut desk, &bytes),
            Step::Frame { version_off, sequence, body } => {
                // Nearly always the right version.
                let version = if version_off == 0xA5 { VERSION.wrapping_add(sequence as u8) } else { VERSION };
                last = frame(version, sequence, &body);
                receive(&mut desk, &last);
            }
            Step::Again => receive(&mut desk, &last),
            Step::Run(ticks) => run(&mut desk, u32::from(ticks), &mut left),
            Step::RunLong(ticks) => run(&mut desk, 64 * u32::from(ticks), &mut left),
            Step::World { vbus_raw, current_raw } => {
                desk.world.vbus_raw = vbus_raw.unwrap_or(Sample::VBUS_NOT_MEASURED);
                desk.world.current_raw = current_raw.unwrap_or(Sample::CURRENT_NOT_SENSED);
            }
            Step::Jump(counts) => desk.jump(counts),
        }
    }
});

/// One COBS block of version, number, content and checksum, with zeros around it.
fn frame(version: u8, sequence: u16, body: &[u8]) -> Vec<u8> {
    let mut content = vec![version];
    // The variable-length number of postcard.
    let mut rest = sequence;
    while rest >= 0x80 {
        content.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    content.push(rest as u8);
    content.extend_from_slice(body);
    let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&content);
    content.extend_from_slice(&checksum.to_le_bytes());
    let mut block = vec![0; 1 + cobs::max_encoding_length(content.len())];
    let length = cobs::encode(&content, &mut block[1..]);
    block.truncate(1 + length);
    block.push(0);
    block
}

/// Every command that is executed is answered at once, no other byte is.
fn receive(desk: &mut Desk, bytes: &[u8]) {
    let before = desk.executed.len();
    let answers = desk.receive(bytes);
    assert!(answers.len() >= desk.executed.len() - before);
    assert!(answers.len() <= bytes.iter().filter(|&&byte| byte == 0).count());
}

/// The tick always comes back, within what the bridge can do, and drives only what was armed.
fn run(desk: &mut Desk, ticks: u32, left: &mut u32) {
    let ticks = ticks.min(*left);
    *left -= ticks;
    for _ in 0..ticks {
        let output = desk.tick();
        let full_scale = desk.config.map_or(0, |config| config.pwm_full_scale);
        assert!(output.bridge == Bridge::Driven || output.duty == 0, "{output:?}");
        assert!(output.duty.unsigned_abs() <= full_scale, "{output:?}");
        assert!(output.bridge == Bridge::Open || desk.armed, "torque without arm: {output:?}");
    }
}
