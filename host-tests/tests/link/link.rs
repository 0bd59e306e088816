//! Invariants of the link. What a frame is, is written down here once more and differently (`oracle`), so that the
//! decoder of the library is held against something other than itself.

use proptest::prelude::*;
use servo::axis::{Bridge, Output};
use servo::compensate::modelled::{DryFriction, Modelled, OverSpeed};
use servo::compensate::position_load::PositionLoad;
use servo::config::Config;
use servo::control::Tuning;
use servo::identify::estimate::{Estimate, Estimates, Mechanism, Reason, Standing};
use servo::link::protocol::{Command, FRAME_CAPACITY, Frame, Message, Refusal, Request, VERSION, encode};
use servo::motion::excitation::{Sweep, Waveform};
use servo::motion::stream::Point;
use servo::optional::Optional;
use servo::protect::Settings;
use servo::store::AxisParameters;
use trials::power_cut::sets::set;
use trials::simulated_servo::{SimulatedServo, config};

/// Frames by the book: split at zeros, undo COBS, divide the polynomial bit by bit, look at version and content.
mod oracle {
    use super::*;

    /// Commands of a byte stream with their numbers, damaged frames left out, in order.
    pub fn frames(stream: &[u8]) -> Vec<(u16, Request)> {
        let closed = stream.iter().rposition(|&byte| byte == 0).map_or(0, |last| last + 1);
        stream[..closed]
            .split(|&byte| byte == 0)
            .filter(|block| !block.is_empty() && block.len() <= FRAME_CAPACITY)
            .filter_map(frame)
            .collect()
    }

    fn frame(block: &[u8]) -> Option<(u16, Request)> {
        let bytes = uncobs(block)?;
        let (content, checksum) = bytes.split_at_checked(bytes.len().checked_sub(4)?)?;
        if crc(content).to_le_bytes() != checksum || *content.first()? != VERSION {
            return None;
        }
        let frame: Frame<Request> = postcard::from_bytes(content).ok()?;
        Some((frame.sequence, frame.body))
    }

    fn uncobs(mut block: &[u8]) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        while let Some((&code, rest)) = block.split_first() {
            let run = usize::from(code) - 1;
            bytes.extend_from_slice(rest.get(..run)?);
            block = &rest[run..];
            if code != 0xFF && !block.is_empty() {
                bytes.push(0);
            }
        }
        Some(bytes)
    }

    /// The bytes of a frame with this content.
    pub fn seal(content: &[u8]) -> Vec<u8> {
        let bytes = [content, &crc(content).to_le_bytes()].concat();
        let runs: Vec<&[u8]> = bytes.split(|&byte| byte == 0).collect();
        assert!(runs.iter().all(|run| run.len() < 0xFE), "one COBS group a run");
        let mut block: Vec<u8> =
            runs.iter().flat_map(|run| [&[run.len() as u8 + 1], *run].concat()).collect();
        block.push(0);
        block
    }

    /// CRC-32 of IEEE 802.3.
    fn crc(bytes: &[u8]) -> u32 {
        let step = |crc: u32, _| (crc >> 1) ^ (0xEDB8_8320 * (crc & 1));
        !bytes.iter().fold(u32::MAX, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
    }

    /// Which of them are executed: the first, and every one up to half a circle ahead of the one before.
    pub fn executed(frames: Vec<(u16, Request)>) -> Vec<(u16, Request)> {
        let mut last = None;
        frames
            .into_iter()
            .filter(|&(sequence, _)| {
                let fresh = last.is_none_or(|last| (1..0x8000).contains(&sequence.wrapping_sub(last)));
                if fresh {
                    last = Some(sequence);
                }
                fresh
            })
            .collect()
    }
}

/// For the only axis of the servo_under_test.
fn request(command: Command) -> Request {
    Request { axis: 0, command }
}

fn frame(sequence: u16, command: Command) -> Vec<u8> {
    frame_for(0, sequence, command)
}

fn frame_for(axis: u8, sequence: u16, command: Command) -> Vec<u8> {
    let mut buffer = [0; FRAME_CAPACITY];
    encode(sequence, Request { axis, command }, &mut buffer).expect("fits").to_vec()
}

/// What a set-point or a bridge can show: everything of a tick but the number of bytes received.
fn shown(output: Output) -> (Bridge, i16, servo::record::Record) {
    (output.bridge, output.duty, output.record)
}

fn same_for(left: &mut SimulatedServo, right: &mut SimulatedServo, ticks: u32) -> Result<(), TestCaseError> {
    for _ in 0..ticks {
        prop_assert_eq!(shown(left.tick()), shown(right.tick()));
    }
    Ok(())
}

/// Any number, the awkward ones often.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![
        -3.0f32..3.0,
        any::<f32>(),
        any::<u32>().prop_map(f32::from_bits),
        Just(f32::NAN),
        Just(f32::INFINITY),
        Just(0.0),
    ]
}

fn configuration() -> impl Strategy<Value = Config> {
    let numbers = (number(), number(), number(), any::<u32>(), any::<u16>(), any::<u8>());
    (numbers, 0..10usize).prop_map(|((a, b, c, count, scale, delay), which)| {
        let mut config = config();
        match which {
            0 => config.supply_nominal_v = a,
            1 => config.rated_speed_rad_s = a,
            2 => config.travel_limit_rad = Some([a, b]),
            3 => (config.counts_per_rev, config.tick_hz) = (count, u32::from(scale)),
            4 => (config.pwm_full_scale, config.pwm_delay_ticks) = (scale, delay),
            5 => (config.vbus_v_per_lsb, config.current_a_per_lsb) = (a, c),
            6 => {
                (config.time_constant_hint_s, config.speed_limit_rad_s) = (Optional::new(a), Optional::new(b))
            }
            7 => (config.supply_low_v, config.supply_high_v) = (Optional::new(a), Optional::new(b)),
            8 => {
                (config.acceleration_limit_rad_s2, config.jerk_limit_rad_s3, config.voltage_limit_v) =
                    (Optional::new(a), Optional::new(b), Optional::new(c))
            }
            _ => {}
        }
        config
    })
}

fn motion() -> impl Strategy<Value = Command> {
    prop_oneof![
        (any::<u32>(), any::<u32>()).prop_map(|(budget_ms, seed)| Command::Commission { budget_ms, seed }),
        (100..5000u32, any::<u32>()).prop_map(|(budget_ms, seed)| Command::Commission { budget_ms, seed }),
        (number(), number(), any::<u32>()).prop_map(|(amplitude_rad, frequency_hz, duration_ms)| {
            Command::TrackSine { amplitude_rad, frequency_hz, duration_ms }
        }),
        (0.01f32..1.0, 0.1f32..5.0, 100..3000u32).prop_map(|(amplitude_rad, frequency_hz, duration_ms)| {
            Command::TrackSine { amplitude_rad, frequency_hz, duration_ms }
        }),
        number().prop_map(Command::Position),
        number().prop_map(Command::Speed),
        (-100.0f32..100.0).prop_map(Command::Speed),
        number().prop_map(Command::Voltage),
        (number(), number(), prop::option::of(number()), any::<u32>()).prop_map(streamed),
        (-0.1f32..0.1, -5.0f32..5.0, prop::option::of(-100.0f32..100.0), 4..200u32).prop_map(streamed),
        (-12.0f32..12.0).prop_map(Command::Voltage),
        (number(), number(), number(), any::<u32>(), any::<bool>()).prop_map(excite),
        (0.1f32..12.0, 0.1f32..500.0, 0.1f32..500.0, 100..3000u32, any::<bool>()).prop_map(excite),
    ]
}

fn streamed(
    (position_rad, speed_rad_s, acceleration_rad_s2, ticks): (f32, f32, Option<f32>, u32),
) -> Command {
    Command::Stream(Point { position_rad, speed_rad_s, acceleration_rad_s2, ticks })
}

fn excite((amplitude_v, from_hz, to_hz, duration_ms, linear): (f32, f32, f32, u32, bool)) -> Command {
    let sweep = if linear { Sweep::Linear } else { Sweep::Logarithmic };
    Command::Excite(Waveform { amplitude_v, from_hz, to_hz, sweep, duration_ms })
}

/// Sets as they would be stored: the servo_under_test's, or with numbers that no commissioning would find.
fn parameters() -> impl Strategy<Value = AxisParameters> {
    let estimate = (any::<i32>(), any::<i32>(), any::<bool>()).prop_map(|(value, u95, trusted)| Estimate {
        value,
        u95,
        standing: if trusted { Standing::Trusted } else { Standing::Doubtful(Reason::Aged) },
    });
    (configuration(), prop::collection::vec(estimate, 6), number(), any::<bool>()).prop_map(
        |(config, numbers, bandwidth, compensation)| AxisParameters {
            config,
            estimates: Estimates {
                dead_zone: [numbers[0], numbers[1]],
                saturation: [numbers[2], numbers[3]],
                gain: numbers[4],
                time_constant: numbers[5],
                gain_skew: 0,
                mechanism: Mechanism::Friction,
            },
            tuning: Tuning { bandwidth, integral: compensation },
            compensation,
            protection: Settings { command_timeout_ms: bandwidth.to_bits() as u16, ..Settings::default() },
            position_load: PositionLoad::default(),
            modelled: Modelled {
                lag: 97,
                load_friction: 9_000,
                over_speed: OverSpeed { skew: -700, drag: 4_000 },
                dry: DryFriction { share: 9_000, breakaway: 4_000, stribeck: 500 },
                play: 41,
                doubted: 0b1000_0110,
            },
        },
    )
}

fn unarmed_command() -> impl Strategy<Value = Command> {
    prop_oneof![
        configuration().prop_map(Command::Configure),
        Just(Command::Stop),
        any::<bool>().prop_map(Command::Compensation),
        any::<[u64; 3]>().prop_map(|all| Command::Modelled(all.into())),
        any::<u32>().prop_map(|every| Command::Subscribe { every }),
        any::<u32>().prop_map(Command::OnTrial),
        parameters().prop_map(Command::Restore),
        Just(Command::Reset),
        Just(Command::Save),
        Just(Command::Hello),
        Just(Command::Parameters),
        motion(),
    ]
}

fn command() -> impl Strategy<Value = Command> {
    prop_oneof![2 => unarmed_command(), 1 => Just(Command::Arm), 1 => motion()]
}

/// A piece of a byte stream: a frame, a damaged frame, or noise.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    let sequence = prop_oneof![0..6u16, 0x7FFD..0x8003u16, 0xFFFD..=0xFFFFu16, any::<u16>()];
    let axis = prop_oneof![8 => Just(0u8), 1 => any::<u8>()];
    let frames =
        (axis, sequence, command()).prop_map(|(axis, sequence, command)| frame_for(axis, sequence, command));
    let damaged = (frames.boxed(), any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0..6u8);
    let damaged = damaged.prop_map(|(mut bytes, place, bit, how)| {
        let place = place.index(bytes.len());
        match how {
            0 => bytes[place] ^= 1 << bit.index(8),
            1 => bytes.truncate(place),
            2 => bytes.insert(place, bit.index(256) as u8),
            3 => drop(bytes.remove(place)),
            4 => bytes = [&bytes[..place], &bytes[..]].concat(),
            _ => {}
        }
        bytes
    });
    prop_oneof![
        4 => damaged,
        1 => prop::collection::vec(any::<u8>(), 0..40),
        1 => prop::collection::vec(1..=255u8, 250..300),
        1 => Just(vec![0]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The link executes exactly the commands that the book says, whatever the bytes: bridge, duty and record of every
    /// tick are those of a twin that gets these commands by hand.
    #[test]
    fn a_byte_stream_does_what_its_valid_frames_say_and_nothing_else(
        pieces in prop::collection::vec((piece(), 0..30u32), 1..25),
    ) {
        let (mut servo_under_test, mut twin) = (SimulatedServo::driving(), SimulatedServo::driving());
        let (mut stream, mut done) = (Vec::new(), 0);
        for (bytes, ticks) in pieces {
            stream.extend_from_slice(&bytes);
            servo_under_test.receive(&bytes);
            let commands = oracle::executed(oracle::frames(&stream));
            for (_, request) in &commands[done..] {
                let _ = twin.request(*request);
            }
            done = commands.len();
            prop_assert_eq!(format!("{:?}", servo_under_test.executed), format!("{commands:?}"));
            same_for(&mut servo_under_test, &mut twin, ticks)?;
        }
        same_for(&mut servo_under_test, &mut twin, 50)?;
    }

    /// Noise without a valid frame is no command, whatever the state.
    #[test]
    fn noise_changes_nothing(noise in prop::collection::vec(any::<u8>(), 0..4000), driving in any::<bool>()) {
        let start = if driving { SimulatedServo::driving() } else { SimulatedServo::default() };
        let (mut servo_under_test, mut twin) = (start.clone(), start);
        prop_assert!(oracle::frames(&noise).is_empty());
        for bytes in noise.chunks(97) {
            prop_assert!(servo_under_test.receive(bytes).is_empty());
            same_for(&mut servo_under_test, &mut twin, 3)?;
        }
    }

    /// Before `Arm` nothing drives the bridge, whatever is asked.
    #[test]
    fn without_arm_the_bridge_stays_open(commands in prop::collection::vec((unarmed_command(), 0..20u32), 1..30)) {
        let mut servo_under_test = SimulatedServo::default();
        servo_under_test.order(Command::Configure(config())).expect("configured");
        for (number, (command, ticks)) in commands.into_iter().enumerate() {
            servo_under_test.receive(&frame(number as u16, command));
            for _ in 0..ticks {
                prop_assert_eq!(servo_under_test.tick().bridge, Bridge::Open);
            }
        }
    }

    /// `Stop` opens the bridge in the tick in which it is executed, whatever went before, and it stays open.
    #[test]
    fn stop_works_in_every_state(commands in prop::collection::vec((command(), 0..200u32), 0..12)) {
        let mut servo_under_test = SimulatedServo::driving();
        for (number, (command, ticks)) in commands.into_iter().enumerate() {
            servo_under_test.receive(&frame(number as u16, command));
            servo_under_test.ticks(ticks);
        }
        let answers = servo_under_test.receive(&frame(100, Command::Stop));
        let accepted = matches!(answers[..], [Message::Answer { to: 100, result: Ok(()), .. }]);
        prop_assert!(accepted, "{:?}", answers);
        for _ in 0..100 {
            prop_assert_eq!(servo_under_test.tick().bridge, Bridge::Open);
        }
    }

    /// A repeated number gets the answer again, an older one is refused with the next number; neither is executed.
    #[test]
    fn repeated_and_old_numbers_are_answered_and_not_executed(
        first in any::<u16>(), commands in prop::collection::vec(command(), 1..10), back in 1..0x8000u16,
    ) {
        let mut servo_under_test = SimulatedServo::driving();
        let mut twin = servo_under_test.clone();
        for (index, command) in commands.into_iter().enumerate() {
            let number = first.wrapping_add(index as u16);
            let answer = servo_under_test.receive(&frame(number, command));
            let _ = twin.order(command);
            prop_assert_eq!(answer.len(), 1);
            let executed = servo_under_test.executed.len();
            for other in [command, Command::Stop, Command::Position(0.3)] {
                prop_assert_eq!(format!("{:?}", servo_under_test.receive(&frame(number, other))), format!("{answer:?}"));
            }
            for answer in servo_under_test.receive(&frame(number.wrapping_sub(back), Command::Stop)) {
                let Message::Answer { result: Err(Refusal::Stale { expected }), .. } = answer else {
                    return Err(TestCaseError::fail(format!("{answer:?}")));
                };
                prop_assert_eq!(expected, number.wrapping_add(1));
            }
            prop_assert_eq!(servo_under_test.executed.len(), executed);
            same_for(&mut servo_under_test, &mut twin, 5)?;
        }
    }
}

fn every_command() -> Vec<Command> {
    vec![
        Command::Configure(config()),
        Command::Arm,
        Command::Stop,
        Command::Commission { budget_ms: 2000, seed: 7 },
        Command::Compensation(false),
        Command::TrackSine { amplitude_rad: 0.5, frequency_hz: 1.0, duration_ms: 1000 },
        Command::Position(2.0),
        Command::Subscribe { every: 10 },
        Command::Adopt(Default::default()),
        Command::Speed(20.0),
        Command::Voltage(-3.0),
        Command::CaptureArm { trigger: servo::link::capture::Trigger::Fault, before: 512 },
        Command::CaptureRead(5),
        Command::Hello,
        Command::Parameters,
        Command::Restore(set(2).axes[0].expect("an axis")),
        Command::Reset,
        Command::Save,
        Command::OnTrial(20_000),
        streamed((0.5, -2.0, Some(30.0), 100)),
        streamed((0.5, -2.0, None, 100)),
    ]
}

/// Exhaustive: one wrong bit anywhere in any command's frame.
#[test]
fn every_single_bit_error_in_every_command_is_dropped() {
    let mut frames = 0;
    for command in every_command() {
        let whole = frame(9, command);
        for bit in 0..8 * whole.len() {
            let mut bytes = whole.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            bytes.push(0);
            let mut servo_under_test = SimulatedServo::default();
            let answers = servo_under_test.receive(&bytes);
            assert!(
                answers.is_empty() && servo_under_test.executed.is_empty(),
                "{command:?}, bit {bit}: {answers:?}"
            );
            frames += 1;
        }
    }
    assert!(frames > 1000, "{frames}");
}

/// Exhaustive: any other version in an otherwise perfect frame.
#[test]
fn frames_of_other_versions_are_dropped() {
    for command in every_command() {
        for version in 0..=255 {
            let content =
                postcard::to_stdvec(&Frame { version, sequence: 1, body: request(command) }).expect("fits");
            let mut servo_under_test = SimulatedServo::default();
            let answers = servo_under_test.receive(&oracle::seal(&content)).len();
            assert_eq!(
                (answers, servo_under_test.executed.len()),
                if version == VERSION { (1, 1) } else { (0, 0) }
            );
        }
    }
}

/// The oracle itself knows a frame when it sees one, and makes the same bytes.
#[test]
fn the_oracle_finds_every_command() {
    for command in every_command() {
        let content = postcard::to_stdvec(&Frame { version: VERSION, sequence: 3, body: request(command) })
            .expect("fits");
        assert_eq!(oracle::seal(&content), frame(3, command));
        let stream = [&[7, 7, 0][..], &frame(3, command), &[1, 2]].concat();
        assert_eq!(oracle::frames(&stream), [(3, request(command))]);
    }
}
