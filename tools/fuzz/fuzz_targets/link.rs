//! Bytes, ticks and strange samples in any order; what must hold after each of them.
//!
//! The fuzzer writes noise as it likes, and frames of which it chooses number and content while checksum and framing are
//! made right here, so that it gets past the checksum and into commands, axis and commissioning.

#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use servo::axis::{Bridge, Sample};
use servo::compensate::position_load::PositionLoad;
use servo::link::capture::Trigger;
use servo::config::Config;
use servo::control::Tuning;
use servo::motion::excitation::{Sweep, Waveform};
use servo::identify::estimate::{Estimate, Estimates, Standing};
use servo::optional::Optional;
use servo::protect::{Condition, Interlock, Settings};
use servo::link::protocol::{Command, FRAME_CAPACITY, Request, VERSION, encode};
use servo::store::AxisParameters;
use servo::motion::stream::Point;

#[path = "../../../trials/src/simulated_servo.rs"]
mod simulated_servo;
use simulated_servo::SimulatedServo;

#[derive(Arbitrary, Debug)]
enum Step {
    /// Bytes as they come.
    Noise(Vec<u8>),
    /// A frame with right framing and checksum, and any content.
    Frame { version_off: u8, sequence: u16, body: Vec<u8> },
    /// A command that is one, with any numbers in it, in its turn.
    Do { other_axis: bool, deed: Deed },
    /// The same bytes once more.
    Again,
    /// Something that only the image sees.
    Heed(u8),
    /// Time passes.
    Run(u8),
    /// Much time passes.
    RunLong(u8),
    /// The board reads something else from now on.
    World { vbus_raw: Option<u16>, current_raw: Option<i16> },
    /// The encoder jumps.
    Jump(i32),
}

/// The commands, so that mutations stay commands.
#[derive(Arbitrary, Debug)]
enum Deed {
    Configure(Setup),
    Restore { setup: Setup, numbers: [i32; 6], bandwidth: f32, compensation: bool },
    Reset,
    Arm,
    Stop,
    Commission { budget_ms: u16, seed: u32 },
    Compensation(bool),
    TrackSine { amplitude_rad: f32, frequency_hz: f32, duration_ms: u16 },
    Position(f32),
    Speed(f32),
    Voltage(f32),
    Excite { amplitude_v: f32, from_hz: f32, to_hz: f32, linear: bool, duration_ms: u16 },
    /// Scaled so that many of them can be.
    Stream { position: i16, speed: i16, acceleration: Option<i16>, ticks: u8 },
    StreamAny { position_rad: f32, speed_rad_s: f32, acceleration_rad_s2: Option<f32>, ticks: u32 },
    Adopt([i32; 6]),
    PositionLoad { head: u64, numbers: [i32; 6] },
    Modelled([u64; 3]),
    CaptureArm { before: u16 },
    Ask(u8),
}

/// The servo_under_test's configuration with one part changed.
#[derive(Arbitrary, Debug)]
struct Setup {
    which: u8,
    number: f32,
    other: f32,
    count: u32,
}

impl Setup {
    fn config(&self) -> Config {
        let mut config = simulated_servo::config();
        let number = Optional::new(self.number);
        match self.which % 17 {
            0 => config.supply_nominal_v = self.number,
            1 => config.rated_speed_rad_s = self.number,
            2 => config.travel_limit_rad = Some([self.number, self.other]),
            3 => config.counts_per_rev = self.count,
            4 => config.tick_hz = self.count,
            5 => config.time_constant_hint_s = number,
            6 => config.current_limit_a = number,
            7 => config.speed_limit_rad_s = number,
            8 => config.energy_limit_j = number,
            9 => config.pwm_delay_ticks = self.count as u8,
            10 => config.gear_ratio = self.number,
            11 => config.supply_low_v = number,
            12 => config.supply_high_v = number,
            13 => config.acceleration_limit_rad_s2 = number,
            14 => config.jerk_limit_rad_s3 = number,
            15 => config.voltage_limit_v = number,
            _ => {}
        }
        config
    }
}

fn estimates(numbers: &[i32; 6]) -> Estimates {
    let trusted = |value: i32| Estimate { value, u95: 1000, standing: Standing::Trusted };
    let [a, b, c, d, e, f] = numbers.map(trusted);
    Estimates { dead_zone: [a, b], saturation: [c, d], gain: e, time_constant: f, ..Estimates::default() }
}

/// Any table: as it travels it is a head and four words.
fn table(head: u64, numbers: &[i32; 6]) -> PositionLoad {
    let [a, b, c, d, ..] = numbers.map(|number| u64::from(number.unsigned_abs()) << 4);
    let mut bytes = [0; 64];
    let bytes = postcard::to_slice(&(head, [a, b, c, d]), &mut bytes).expect("five words fit");
    postcard::from_bytes(bytes).expect("five words are a table")
}

impl Deed {
    fn command(&self) -> Command {
        match *self {
            Deed::Configure(ref setup) => Command::Configure(setup.config()),
            Deed::Restore { ref setup, ref numbers, bandwidth, compensation } => Command::Restore(AxisParameters {
                config: setup.config(),
                estimates: estimates(numbers),
                tuning: Tuning { bandwidth, integral: compensation },
                compensation,
                protection: Settings { command_timeout_ms: bandwidth.to_bits() as u16, ..Settings::default() },
                position_load: table(0, numbers),
                modelled: [u64::from(bandwidth.to_bits()); 3].into(),
            }),
            Deed::Reset => Command::Reset,
            Deed::Arm => Command::Arm,
            Deed::Stop => Command::Stop,
            Deed::Commission { budget_ms, seed } => Command::Commission { budget_ms: budget_ms.into(), seed },
            Deed::Compensation(on) => Command::Compensation(on),
            Deed::TrackSine { amplitude_rad, frequency_hz, duration_ms } => {
                Command::TrackSine { amplitude_rad, frequency_hz, duration_ms: duration_ms.into() }
            }
            Deed::Position(rad) => Command::Position(rad),
            Deed::Speed(rad_s) => Command::Speed(rad_s),
            Deed::Voltage(volts) => Command::Voltage(volts),
            Deed::Excite { amplitude_v, from_hz, to_hz, linear, duration_ms } => Command::Excite(Waveform {
                amplitude_v,
                from_hz,
                to_hz,
                sweep: if linear { Sweep::Linear } else { Sweep::Logarithmic },
                duration_ms: duration_ms.into(),
            }),
            Deed::Stream { position, speed, acceleration, ticks } => Command::Stream(Point {
                position_rad: f32::from(position) / 1e4,
                speed_rad_s: f32::from(speed) / 1e3,
                acceleration_rad_s2: acceleration.map(|a| f32::from(a) / 10.0),
                ticks: ticks.into(),
            }),
            Deed::StreamAny { position_rad, speed_rad_s, acceleration_rad_s2, ticks } => {
                Command::Stream(Point { position_rad, speed_rad_s, acceleration_rad_s2, ticks })
            }
            Deed::Adopt(ref numbers) => Command::Adopt(estimates(numbers)),
            Deed::PositionLoad { head, ref numbers } => Command::PositionLoad(table(head, numbers)),
            Deed::Modelled(all) => Command::Modelled(all.into()),
            Deed::CaptureArm { before } => Command::CaptureArm { trigger: Trigger::Fault, before },
            Deed::Ask(what) => match what % 5 {
                0 => Command::Hello,
                1 => Command::Parameters,
                2 => Command::Save,
                3 => Command::OnTrial(what.into()),
                _ => Command::CaptureRead(what.into()),
            },
        }
    }
}

/// Ticks that one input may use: two seconds.
const TICKS: u32 = 20_000;

fuzz_target!(|input: (bool, Vec<Step>)| {
    let (driving, steps) = input;
    let mut servo_under_test = if driving { SimulatedServo::driving() } else { SimulatedServo::default() };
    let (mut left, mut last, mut turn) = (TICKS, Vec::new(), 0u16);
    for step in steps {
        match step {
            Step::Noise(bytes) => receive(&mut servo_under_test, &bytes),
            Step::Frame { version_off, sequence, body } => {
                // Nearly always the right version.
                let version = if version_off == 0xA5 { VERSION.wrapping_add(sequence as u8) } else { VERSION };
                last = frame(version, sequence, &body);
                receive(&mut servo_under_test, &last);
            }
            Step::Do { other_axis, deed } => {
                turn = turn.wrapping_add(1);
                let request = Request { axis: other_axis.into(), command: deed.command() };
                let mut buffer = [0; FRAME_CAPACITY];
                last = encode(turn, request, &mut buffer).expect("every command fits").to_vec();
                receive(&mut servo_under_test, &last);
            }
            Step::Again => receive(&mut servo_under_test, &last),
            Step::Heed(what) => servo_under_test.raise(match what % 5 {
                0 => Condition::Interlock(Interlock::Disabled),
                1 => Condition::Interlock(Interlock::BridgeFault),
                2 => Condition::TickOverrun,
                3 => Condition::WatchdogReset,
                _ => Condition::ParametersDamaged,
            }),
            Step::Run(ticks) => run(&mut servo_under_test, u32::from(ticks), &mut left),
            Step::RunLong(ticks) => run(&mut servo_under_test, 64 * u32::from(ticks), &mut left),
            Step::World { vbus_raw, current_raw } => {
                servo_under_test.world.vbus_raw = vbus_raw.unwrap_or(Sample::VBUS_NOT_MEASURED);
                servo_under_test.world.current_raw = current_raw.unwrap_or(Sample::CURRENT_NOT_SENSED);
            }
            Step::Jump(counts) => servo_under_test.jump(counts),
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
fn receive(servo_under_test: &mut SimulatedServo, bytes: &[u8]) {
    let before = servo_under_test.executed.len();
    let answers = servo_under_test.receive(bytes);
    assert!(answers.len() >= servo_under_test.executed.len() - before);
    assert!(answers.len() <= bytes.iter().filter(|&&byte| byte == 0).count());
}

/// The tick always comes back, within what the bridge can do, and drives only what was armed.
fn run(servo_under_test: &mut SimulatedServo, ticks: u32, left: &mut u32) {
    let ticks = ticks.min(*left);
    *left -= ticks;
    for _ in 0..ticks {
        let output = servo_under_test.tick();
        let full_scale = servo_under_test.config.map_or(0, |config| config.pwm_full_scale);
        assert!(output.bridge == Bridge::Driven || output.duty == 0, "{output:?}");
        assert!(output.duty.unsigned_abs() <= full_scale, "{output:?}");
        assert!(output.bridge == Bridge::Open || servo_under_test.armed, "torque without arm: {output:?}");
    }
}
