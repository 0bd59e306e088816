//! The bytes of every command, refusal and fault, as they were first published: hosts and servos of different ages understand
//! each other by them.

use servo::compensate::modelled::{DryFriction, Modelled, OverSpeed};
use servo::config::{Config, ConfigError, Field};
use servo::drivers::scales::ScaleError;
use servo::link::capture::Trigger;
use servo::link::protocol::{Command, Refusal};
use servo::motion::excitation::{Sweep, Waveform};
use servo::motion::referencing::Referencing;
use servo::motion::stream::Point;
use servo::protect::{Action, Fault, Forbidden, SettingsError};
use servo::record::Activity;
use trials::power_cut::sets::set;

fn commands() -> Vec<Command> {
    let parameters = set(1).axes[0].expect("an axis");
    let waveform =
        Waveform { amplitude_v: 1.5, from_hz: 1.0, to_hz: 9.0, sweep: Sweep::Logarithmic, duration_ms: 700 };
    vec![
        Command::Configure(Config::EXAMPLE),
        Command::Arm,
        Command::Stop,
        Command::Commission { budget_ms: 5_000, seed: 7 },
        Command::Compensation(true),
        Command::TrackSine { amplitude_rad: 1.0, frequency_hz: 2.0, duration_ms: 3_000 },
        Command::Position(-1.5),
        Command::Subscribe { every: 300 },
        Command::Adopt(parameters.estimates),
        Command::Speed(2.5),
        Command::Voltage(-3.5),
        Command::CaptureArm { trigger: Trigger::Activity(Activity::Holding), before: 256 },
        Command::CaptureArm { trigger: Trigger::Now, before: 0 },
        Command::CaptureArm { trigger: Trigger::Fault, before: 1 },
        Command::CaptureArm { trigger: Trigger::Limit, before: 2 },
        Command::CaptureRead(1_023),
        Command::Hello,
        Command::Parameters,
        Command::Restore(parameters),
        Command::Reset,
        Command::Save,
        Command::Reference(Referencing::Here { position_rad: 0.5 }),
        Command::GoTo(4.5),
        Command::Excite(waveform),
        Command::Stream(Point {
            position_rad: 0.25,
            speed_rad_s: 0.5,
            acceleration_rad_s2: Some(0.75),
            ticks: 200,
        }),
        Command::PositionLoad(set(2).axes[0].expect("an axis").position_load),
        Command::Modelled(Modelled { lag: 389, ..Modelled::default() }),
        Command::Modelled(Modelled { lag: 389, load_friction: 9_000, ..Modelled::default() }),
        Command::Modelled(Modelled {
            over_speed: OverSpeed { skew: -1_000, drag: 500 },
            ..Modelled::default()
        }),
        Command::Modelled(Modelled {
            dry: DryFriction { share: 9_000, breakaway: 4_000, stribeck: 500 },
            ..Modelled::default()
        }),
        Command::Modelled(Modelled { play: 41, ..Modelled::default() }),
        Command::Modelled(Modelled { lag: 389, doubted: 1, ..Modelled::default() }),
        Command::OnTrial(200_000),
    ]
}

fn refusals() -> Vec<Refusal> {
    let error = ConfigError { field: Field::VoltageLimit, minimum: 1.0, maximum: 12.0 };
    let forbidden = Forbidden { fault: Fault::Disabled, action: Action::Brake };
    vec![
        Refusal::Config(error),
        Refusal::TickRate,
        Refusal::NotConfigured,
        Refusal::BridgeDriven,
        Refusal::NotArmed,
        Refusal::Faulted,
        Refusal::NotIdentified,
        Refusal::Busy,
        Refusal::BeyondTravel,
        Refusal::OutOfRange,
        Refusal::NotForAxis,
        Refusal::NotReferenced,
        Refusal::Value(error),
        Refusal::StreamFull,
        Refusal::CurrentZeroSought,
        Refusal::BeyondVoltage { needed_v: 9.0, available_v: 8.0 },
        Refusal::BeyondSpeed { needed_rad_s: 9.0, available_rad_s: 8.0 },
        Refusal::Stale { expected: 700 },
        Refusal::NoSuchAxis,
        Refusal::SharedTick,
        Refusal::Storing,
        Refusal::NotAtRest,
        Refusal::Parameters(SettingsError::Action(forbidden)),
        Refusal::Parameters(SettingsError::Value(error)),
        Refusal::Scale(ScaleError { field: Field::CurrentPerLsb, given: 1.0, board: 2.0 }),
    ]
}

fn hex<T: serde::Serialize>(value: &T) -> String {
    let bytes = postcard::to_allocvec(value).expect("bytes");
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// If this fails, a published number has changed: append variants instead.
#[test]
fn commands_refusals_and_faults_are_the_bytes_that_they_were() {
    let mut lines: Vec<String> = commands().iter().map(hex).collect();
    lines.extend(refusals().iter().map(hex));
    let faults = [Fault::None].into_iter().chain(Fault::ALL);
    lines.extend(faults.map(|fault| format!("{} {} {}", hex(&fault), fault as u8, fault.name())));
    let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
    assert_eq!(text, include_str!("wire_bytes.txt"));
}
