//! How deep the stack of the image gets in QEMU, over everything that a joint does in its life: a first start, a
//! configuration, a commissioning, a save with its erase, a sine, a fault; then a start from the store.
//!
//! Idle pends the control interrupt itself here, always from the same shallow place, so control on top of link on top of a
//! save is not in it. The bound that `cargo xtask size` works out from the calls is. What was measured must stay below it.

use servo::protect::Interlock;
use servo::record::Activity;
use trials::families::{Family, Options as PlantOptions, Plant, Seeds, Severity};
use trials::firmware::power_up;
use truing::device::link::Client;
use truing::device::motor::qemu::Lines;
use truing::device::session::{self, Listening, Profile, Start, Task};

/// The deepest that was seen, bytes.
const DOCUMENTED: f64 = 3_584.0;

/// What the image says of its stack at its end.
fn depth(log: &[String]) -> f64 {
    let words = |line: &String| -> Option<f64> {
        let (_, behind) = line.split_once("stack: ")?;
        behind.split_once(" bytes")?.0.parse().ok()
    };
    log.iter().find_map(words).unwrap_or_else(|| panic!("no depth in {log:?}"))
}

#[test]
fn the_stack_is_as_deep_as_documented() {
    let plant =
        Plant::draw(Family::G1, Severity::Nominal, Seeds::Evaluation(400_030), &PlantOptions::default());
    let folder = tempfile::tempdir().expect("a folder");
    let flash = folder.path().join("flash.bin");
    let listening = Listening { axis: 0, every: 1 };
    let commission = Task::Commission { budget_s: 5.0, seed: 1 };
    let sine = Task::Track {
        profile: Profile::Sine { amplitude_rad: 2.0, frequency_hz: 1.0, seconds: 2.0 },
        compensation: true,
    };

    let wire = power_up(&flash, &plant);
    let tasks = [commission, Task::Store, sine];
    let first = session::run_kept(
        Box::new(wire),
        Start::Configure(plant.config.into()),
        listening,
        &tasks,
        &mut |_| {},
    )
    .and_then(session::SessionResult::complete);
    let first = depth(&first.expect("a session").firmware_log);

    let wire = power_up(&flash, &plant);
    let lines = wire.lines();
    let mut again = Client::new(Box::new(wire));
    assert!(again.parameters().expect("an answer").is_some(), "nothing was stored");
    lines.set(Lines { interlock: Interlock::BridgeFault, ..Lines::default() });
    let mut faulted = false;
    let mut heed = |message| {
        if let servo::link::protocol::Message::Telemetry { record, .. } = message {
            faulted |= record.activity == Activity::Faulted;
        }
    };
    again.command(servo::link::protocol::Command::Subscribe { every: 1 }, &mut heed).expect("subscribed");
    for _ in 0..20 {
        again.turn(&mut heed).expect("a turn");
    }
    let later = depth(&again.close().firmware_log);
    assert!(faulted, "the fault was not there");

    let deepest = first.max(later);
    println!("first life {first} bytes, from the store {later} bytes");
    assert!((deepest / DOCUMENTED - 1.0).abs() < 0.03, "{deepest} bytes, documented {DOCUMENTED}");
}
