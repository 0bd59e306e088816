//! The image's life beyond one session, in QEMU: parameters that survive, the erase that is announced, and the faults
//! that only the image can see.

use servo::axis::Bridge;
use servo::link::protocol::{Command, Message, ResetCause};
use servo::protect::{Fault, Interlock};
use servo::record::{Activity, Record, Source};
use servo::store::StoreEvent;
use servo::store::{AtRest, AxisParameters, Found, LAYOUT};
use std::path::Path;
use trials::families::{Family, Options as PlantOptions, Plant, Seeds, Severity};
use trials::firmware::{power_up, qemu};
use trials::power_cut::flash::Flash;
use trials::power_cut::suite::Store;
use trials::virtual_motor::VirtualMotor;
use truing::device::link::{Client, Lockstep, fault_advice};
use truing::device::motor::qemu::{Lines, Options};
use truing::device::replay::{self, Telling};
use truing::device::run_log::Tape;
use truing::device::session::{self, Done, Listening, Profile, SessionResult, Start, Task};
use truing::device::tracking::TrackJson;

const COMMISSION: Task = Task::Commission { budget_s: 5.0, seed: 1 };
const LISTENING: Listening = Listening { axis: 0, every: 1 };

fn plant() -> Plant {
    Plant::draw(Family::G1, Severity::Nominal, Seeds::Evaluation(400_020), &PlantOptions::default())
}

/// Of 76 counts: over a few, where in its count the axis begins says more than its numbers.
fn sine() -> Task {
    Task::Track {
        profile: Profile::Sine { amplitude_rad: 10.0, frequency_hz: 1.0, seconds: 3.0 },
        compensation: true,
    }
}

/// A power-up on this flash.
fn wire(flash: &Path) -> Lockstep {
    power_up(flash, &plant())
}

fn client(flash: &Path) -> Client {
    Client::new(Box::new(wire(flash)))
}

fn run(flash: &Path, start: Start, tasks: &[Task]) -> SessionResult {
    session::run_kept(Box::new(wire(flash)), start, LISTENING, tasks, &mut |_| {})
        .and_then(session::SessionResult::complete)
        .expect("a session")
}

/// Sends a command; what the telemetry says while its answer is awaited goes to `last`.
fn send(client: &mut Client, last: &mut Record, command: Command) -> Result<u32, String> {
    client.command(command, &mut |message| keep(last, message)).map_err(|error| error.to_string())
}

fn keep(last: &mut Record, message: Message) {
    if let Message::Telemetry { record, .. } = message {
        *last = record;
    }
}

fn turns(client: &mut Client, last: &mut Record, count: u32) {
    for _ in 0..count {
        client.turn(&mut |message| keep(last, message)).expect("a turn");
    }
}

/// Saves; the announced erases.
fn save(client: &mut Client) -> Vec<StoreEvent> {
    let mut announced = Vec::new();
    let mut heed = |message| {
        if let Message::Store(event) = message {
            announced.push(event);
        }
    };
    client.save(&mut heed).expect("stored");
    announced
}

#[test]
fn what_was_commissioned_survives_a_restart_and_is_used() {
    let folder = tempfile::tempdir().expect("a folder");
    let flash = folder.path().join("flash.bin");
    let first = run(&flash, Start::Configure(plant().config.into()), &[COMMISSION, Task::Store, sine()]);
    let [Done::Commissioned(outcome), Done::Stored, Done::Tracked(fresh)] = &first.done[..] else {
        panic!("{:?}", first.done);
    };

    // The first save of a life erases, too: the log has every tick of it.
    let ticks: Vec<u32> = first.log.rows.iter().map(|row| row.tick).collect();
    let gap = ticks.windows(2).find(|pair| pair[1] != pair[0] + 1);
    assert_eq!(gap, None, "of {} rows", ticks.len());

    let mut again = client(&flash);
    let hello = again.hello().expect("a hello");
    assert_eq!(hello.stored, Found::Set { layout: LAYOUT });
    assert_eq!((hello.axes, hello.cause), (1, ResetCause::Power));
    let stored = again.parameters().expect("an answer").expect("configured");
    assert_eq!(stored.config, plant().config);
    assert_eq!(stored.estimates.dead_zone, outcome.estimates.dead_zone);
    assert_eq!(stored.estimates.gain, outcome.estimates.gain);
    assert_eq!(stored.estimates.mechanism, outcome.estimates.mechanism);
    again.close();

    // Nothing is configured or commissioned in this life.
    let later = run(&flash, Start::Stored, &[sine()]);
    let [Done::Tracked(span)] = &later.done[..] else {
        panic!("{:?}", later.done);
    };
    assert!(!span.faulted);
    let used = &later.log.rows.last().expect("rows").record;
    assert_eq!(used.gain_source, Source::Stored);
    assert_eq!(used.dead_zone_source, [Source::Stored; 2]);
    let (fresh, later) = (
        TrackJson::new(&first.log, fresh).position_rms_rad,
        TrackJson::new(&later.log, span).position_rms_rad,
    );
    assert!(
        (later / fresh - 1.0).abs() < 0.25,
        "{fresh} rad with what was just learned, {later} rad with what was stored"
    );
}

#[test]
fn an_erase_is_announced_and_nothing_is_armed_meanwhile() {
    let folder = tempfile::tempdir().expect("a folder");
    let flash = folder.path().join("flash.bin");
    let mut client = client(&flash);
    let mut last = Record::default();
    send(&mut client, &mut last, Command::Subscribe { every: 1 }).expect("subscribed");
    send(&mut client, &mut last, Command::Configure(plant().config)).expect("configured");

    let refused = send(&mut client, &mut last, Command::Save).expect_err("nobody knows yet that it stands");
    assert!(refused.contains("every shaft stands"), "{refused}");
    turns(&mut client, &mut last, 60);

    // A blank flash was never erased by this store: the first save erases, and so does the one for which there is no slot.
    send(&mut client, &mut last, Command::Save).expect("accepted");
    let refused = send(&mut client, &mut last, Command::Arm).expect_err("the bridge must stay open");
    assert!(refused.contains("storing"), "{refused}");
    let refused = send(&mut client, &mut last, Command::Save).expect_err("one at a time");
    assert!(refused.contains("storing"), "{refused}");
    turns(&mut client, &mut last, 200);

    let erases: Vec<usize> = (0..14).map(|_| save(&mut client).len()).collect();
    // Six slots a sector: one is used, five are left, then six from every erase on.
    assert_eq!(erases, [0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0]);
    send(&mut client, &mut last, Command::Arm).expect("armed when it is over");
    send(&mut client, &mut last, Command::Voltage(3.0)).expect("drives");
    turns(&mut client, &mut last, 50);
    let refused = send(&mut client, &mut last, Command::Save).expect_err("the motor is driven");
    assert!(refused.contains("stop the servo"), "{refused}");
}

#[test]
fn parameters_are_read_changed_and_forgotten() {
    let folder = tempfile::tempdir().expect("a folder");
    let flash = folder.path().join("flash.bin");
    let mut life = client(&flash);
    assert_eq!(life.hello().expect("a hello").stored, Found::Blank);
    assert_eq!(life.parameters().expect("an answer"), None);
    life.command(Command::Configure(plant().config), &mut |_| {}).expect("configured");
    let mut changed = life.parameters().expect("an answer").expect("configured");
    changed.tuning.bandwidth = 1.25;
    changed.compensation = false;
    life.command(Command::Restore(changed), &mut |_| {}).expect("in force");
    assert_eq!(life.parameters().expect("an answer"), Some(changed));
    let impossible =
        AxisParameters { tuning: servo::control::Tuning { bandwidth: 100.0, integral: true }, ..changed };
    let refused = life.command(Command::Restore(impossible), &mut |_| {}).expect_err("out of range");
    assert!(refused.to_string().contains("loops.bandwidth"), "{refused}");
    save(&mut life);
    life.close();

    let mut life = client(&flash);
    assert_eq!(life.parameters().expect("an answer"), Some(changed));
    life.command(Command::Reset, &mut |_| {}).expect("forgotten");
    save(&mut life);
    life.close();

    let mut life = client(&flash);
    assert_eq!(life.hello().expect("a hello").stored, Found::Set { layout: LAYOUT });
    assert_eq!(life.parameters().expect("an answer"), None);
}

/// The host is gone in the middle of a motion, with a candidate in force that was never stored.
#[test]
fn a_trial_whose_host_is_gone_gives_back_what_was_stored() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut client = client(&folder.path().join("flash.bin"));
    let mut last = Record::default();
    let stored = AxisParameters::new(plant().config);
    send(&mut client, &mut last, Command::Restore(stored)).expect("at rest");
    save(&mut client);
    let mut candidate = stored;
    candidate.tuning.bandwidth = 2.0;
    for command in [
        Command::OnTrial(3_000),
        Command::Restore(candidate),
        Command::Subscribe { every: 1 },
        Command::Arm,
        Command::Voltage(6.0),
    ] {
        send(&mut client, &mut last, command).expect("at rest");
    }
    turns(&mut client, &mut last, 2_900);
    assert_eq!(last.bridge, Bridge::Driven);
    // Every record until the silence is over, then none.
    let (mut driven, mut started) = (0, None);
    for _ in 0..1_000 {
        let mut heed = |message| match message {
            Message::Telemetry { record, .. } => driven += u32::from(record.bridge == Bridge::Driven),
            Message::Hello { cause, stored, .. } => started = Some((cause, stored)),
            _ => {}
        };
        client.turn(&mut heed).expect("the image goes on");
    }
    assert_eq!(started, Some((ResetCause::Software, Found::Set { layout: LAYOUT })));
    assert!((90..=100).contains(&driven), "{driven} ticks until the stop");
    assert_eq!(client.parameters().expect("an answer"), Some(stored));
}

#[test]
fn damaged_parameters_are_a_fault_until_somebody_has_seen_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let flash = folder.path().join("flash.bin");
    let mut life = client(&flash);
    life.command(Command::Configure(plant().config), &mut |_| {}).expect("configured");
    save(&mut life);
    life.close();
    let mut bytes = std::fs::read(&flash).expect("the flash");
    bytes.iter_mut().for_each(|byte| *byte &= 0x5A);
    std::fs::write(&flash, bytes).expect("a damaged flash");

    let mut life = client(&flash);
    assert_eq!(life.hello().expect("a hello").stored, Found::Damaged);
    assert_eq!(life.parameters().expect("an answer"), None, "never guessed");
    life.close();
    let result = run(&flash, Start::Configure(plant().config.into()), &[COMMISSION, Task::Store]);
    assert_eq!(result.cleared, Fault::ParametersDamaged);
    assert!(matches!(result.done[..], [Done::Commissioned(_), Done::Stored]));
    assert_eq!(client(&flash).hello().expect("a hello").stored, Found::Set { layout: LAYOUT });
}

/// What a newer image has stored is left alone and reported.
#[test]
fn parameters_of_a_newer_image_are_not_guessed() {
    let folder = tempfile::tempdir().expect("a folder");
    let flash = folder.path().join("flash.bin");
    let rest = AtRest::check(Bridge::Open, true).expect("at rest");
    let mut newer = Store::<4096>::new(Flash::new(1), 0);
    newer.erase(rest).expect("erased");
    newer.save_as(&(1u8, [2u16; 9]), LAYOUT + 1, rest).expect("saved");
    std::fs::write(&flash, newer.flash().bytes()).expect("a flash");

    let mut life = client(&flash);
    assert_eq!(life.hello().expect("a hello").stored, Found::Unreadable { layout: LAYOUT + 1 });
    assert_eq!(life.parameters().expect("an answer"), None);
}

#[test]
fn the_cause_of_a_start_is_told_and_a_watchdog_has_to_be_acknowledged() {
    let options = Options { started_by_watchdog: true, ..qemu() };
    let plant = plant();
    let wire = Lockstep::start(&options, Box::new(VirtualMotor::new(&plant)), plant.config).expect("QEMU");
    let mut client = Client::new(Box::new(wire));
    let mut last = Record::default();
    assert_eq!(client.hello().expect("a hello").cause, ResetCause::Watchdog);
    send(&mut client, &mut last, Command::Subscribe { every: 1 }).expect("subscribed");
    send(&mut client, &mut last, Command::Configure(plant.config)).expect("configured");
    turns(&mut client, &mut last, 3);
    assert_eq!((last.fault, last.activity), (Fault::WatchdogReset, Activity::Faulted));
    let refused = send(&mut client, &mut last, Command::Arm).expect_err("a fault is latched");
    assert!(refused.contains("fault"), "{refused}");
    send(&mut client, &mut last, Command::Stop).expect("acknowledged");
    send(&mut client, &mut last, Command::Arm).expect("armed");
}

/// The contact opens while the shaft turns. No sample shows that, and the log is replayed all the same, in the monitor's
/// words.
#[test]
fn a_replay_gives_the_notice_behind_a_fault_and_names_it() {
    let plant = plant();
    let wire = Lockstep::start(&qemu(), Box::new(VirtualMotor::new(&plant)), plant.config).expect("QEMU");
    let lines = wire.lines();
    let mut open_contact = |progress: session::Progress| {
        if progress.task == "tracking" && progress.share > 0.3 {
            lines.set(Lines { interlock: Interlock::Disabled, ..Lines::default() });
        }
    };
    let start = Start::Configure(plant.config.into());
    let tasks = [COMMISSION, sine()];
    let result = session::run_kept(Box::new(wire), start, LISTENING, &tasks, &mut open_contact)
        .and_then(session::SessionResult::complete);
    let result = result.expect("a session");
    let Some(Done::Tracked(span)) = result.done.last() else {
        panic!("{:?}", result.done);
    };
    assert!(span.faulted);
    // Through the file, as a user would.
    let text = result.log.to_csv();
    let tape = Tape::parse("run.csv", &text, &plant.config).expect("a tape");
    let verdict = replay::replay(&tape).expect("a replay");
    assert!(verdict.identical(), "{verdict}");
    let faults: Vec<&(u32, Telling)> = verdict.told.iter().collect();
    let [(tick, Telling::Fault(Fault::Disabled))] = faults[..] else {
        panic!("{faults:?}");
    };
    assert!((span.start..span.hold).contains(tick) || *tick == span.hold, "{tick} of {span:?}");
    let words = Telling::Fault(Fault::Disabled).to_string();
    assert!(words.contains(&fault_advice(Fault::Disabled)), "{words}");
}

#[test]
fn what_only_the_board_sees_opens_the_bridge_at_once() {
    let cases = [
        (Lines { overrun: true, ..Lines::default() }, Fault::TickOverrun),
        (Lines { interlock: Interlock::Disabled, ..Lines::default() }, Fault::Disabled),
        (Lines { interlock: Interlock::BridgeFault, ..Lines::default() }, Fault::BridgeFault),
    ];
    let plant = plant();
    let wire = Lockstep::start(&qemu(), Box::new(VirtualMotor::new(&plant)), plant.config).expect("QEMU");
    let lines = wire.lines();
    let mut client = Client::new(Box::new(wire));
    let mut last = Record::default();
    send(&mut client, &mut last, Command::Subscribe { every: 1 }).expect("subscribed");
    send(&mut client, &mut last, Command::Configure(plant.config)).expect("configured");
    for (pulled, fault) in cases {
        for command in [Command::Stop, Command::Arm, Command::Voltage(3.0)] {
            send(&mut client, &mut last, command).expect("drives");
        }
        turns(&mut client, &mut last, 100);
        assert_eq!((last.fault, last.bridge), (Fault::None, Bridge::Driven));
        lines.set(pulled);
        // The line is seen in the tick of this turn (an overrun in the next one), its record arrives one turn later.
        turns(&mut client, &mut last, 3);
        assert_eq!((last.fault, last.command_bridge), (fault, Bridge::Open));
        lines.set(Lines::default());
        turns(&mut client, &mut last, 5);
        assert_eq!(last.fault, fault, "latched");
        let refused = send(&mut client, &mut last, Command::Arm).expect_err("a fault is latched");
        assert!(refused.contains("fault"), "{refused}");
    }
}
