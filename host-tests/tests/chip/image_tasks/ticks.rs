use super::image::board::{AXES, Board as _, NAME, Started};
use super::image::tick::Order;
use super::rig::{Fields, LOOK, STARTED, Task, ZEROS};
use servo::axis::{Bridge, Command, Sample};
use servo::config::Config;
use servo::drivers::drv8301::Trouble;
use servo::drivers::gates::State;
use servo::drivers::saving::{Job, Report};
use servo::identify::estimate::{Estimate, Estimates, Standing};
use servo::link::board::{Board, Clock, GateTrouble, Gates};
use servo::link::capture::{Stage, Trigger};
use servo::link::protocol::{Message, Refusal, ResetCause};
use servo::motion::referencing::Referencing;
use servo::protect::{Fault, Interlock};
use servo::record::{Activity, Record, Referenced};
use servo::store::{AxisParameters, Found, StoreEvent};

const NOT_SENSED: [i16; 2] = [Sample::CURRENT_NOT_SENSED; 2];

fn config() -> Config {
    Config {
        supply_nominal_v: 12.0,
        counts_per_rev: 4000,
        rated_speed_rad_s: 125.0,
        tick_hz: 10_000,
        pwm_full_scale: 4200,
        vbus_v_per_lsb: 0.01,
        current_a_per_lsb: 0.005,
        ..Config::EXAMPLE
    }
}

/// Both axes configured and at rest.
fn ready() -> Task {
    let mut task = Task::new(STARTED, Found::Blank);
    for axis in 0..AXES as u8 {
        task.configure(axis, &config()).expect("a good configuration");
    }
    task.ticks(3_000);
    task.told();
    task
}

/// The records of both axes in the next tick.
fn records(task: &mut Task) -> [Record; AXES] {
    for axis in 0..AXES as u8 {
        task.run(axis, Command::Subscribe { every: 1 }).expect("a service");
    }
    while task.records.dequeue().is_some() {}
    task.tick();
    let told: Vec<Message> = std::iter::from_fn(|| task.records.dequeue()).map(Message::from).collect();
    for axis in 0..AXES as u8 {
        task.run(axis, Command::Subscribe { every: 0 }).expect("a service");
    }
    std::array::from_fn(|number| match told[number] {
        Message::Telemetry { axis, record, .. } if usize::from(axis) == number => record,
        ref other => panic!("{other:?}"),
    })
}

fn faults(task: &mut Task) -> [Fault; AXES] {
    records(task).map(|record| record.fault)
}

#[test]
fn a_fault_line_or_an_open_contact_is_told_to_its_axis_alone_and_ends_what_it_does() {
    for (interlock, fault) in
        [(Interlock::BridgeFault, Fault::BridgeFault), (Interlock::Disabled, Fault::Disabled)]
    {
        let mut task = ready();
        task.run(1, Command::Arm).expect("at rest");
        task.run(1, Command::Voltage(3.0)).expect("armed");
        task.ticks(20);
        assert_eq!(task.world.bridges.map(|set| set.0), [Bridge::Open, Bridge::Driven]);
        task.world.interlocks[1] = interlock;
        task.tick();
        assert_eq!(task.world.bridges[1].0, Bridge::Open);
        task.world.interlocks[1] = Interlock::Granted;
        assert_eq!(faults(&mut task), [Fault::None, fault]);
        assert_eq!(task.run(1, Command::Arm), Err(Refusal::Faulted));
    }
}

#[test]
fn a_tick_that_is_late_is_an_overrun_on_every_axis() {
    let mut task = ready();
    task.world.late = true;
    task.tick();
    task.world.late = false;
    assert_eq!(faults(&mut task), [Fault::TickOverrun; AXES]);
}

/// Setting the timers anew takes a tick away, with the bridges open.
#[test]
fn the_tick_of_a_configuration_may_be_late() {
    let mut task = ready();
    task.world.late = true;
    task.configure(0, &config()).expect("at rest");
    task.world.late = false;
    assert_eq!(faults(&mut task), [Fault::None; AXES]);
    // An order that sets no timer is no excuse.
    task.world.late = true;
    task.run(0, Command::Stop).expect("always");
    task.world.late = false;
    assert_eq!(faults(&mut task), [Fault::TickOverrun; AXES]);
}

#[test]
fn a_configuration_that_is_carried_out_reaches_the_board_and_one_that_is_refused_does_not() {
    let mut task = ready();
    assert_eq!(task.world.configured, [(0, config()), (1, config())]);
    task.run(0, Command::Arm).expect("at rest");
    task.run(0, Command::Voltage(3.0)).expect("armed");
    task.ticks(5);
    assert_eq!(task.configure(0, &config()), Err(Refusal::BridgeDriven));
    assert_eq!(task.world.configured.len(), 2);
}

/// One timer paces all axes.
#[test]
fn an_axis_cannot_have_another_control_rate_or_pwm_than_the_others() {
    let mut task = ready();
    for other in [
        Config { tick_hz: 5_000, ..config() },
        Config { pwm_full_scale: 8_400, ..config() },
        Config { pwm_delay_ticks: 2, ..config() },
    ] {
        assert_eq!(task.configure(1, &other), Err(Refusal::SharedTick));
    }
    task.order(0, Order::Run(Command::Reset)).expect("at rest");
    task.configure(1, &Config { tick_hz: 5_000, ..config() }).expect("the other one has none");
}

#[test]
fn an_order_for_an_axis_that_is_not_there_is_refused() {
    let mut task = ready();
    assert_eq!(task.run(AXES as u8, Command::Stop), Err(Refusal::NoSuchAxis));
    assert_eq!(task.run(AXES as u8, Command::Hello), Err(Refusal::NoSuchAxis));
}

/// The gains follow from a configuration one stage a tick.
#[test]
fn a_motion_waits_until_the_axis_has_its_gains_and_a_stop_does_not() {
    let mut task = Task::new(STARTED, Found::Blank);
    task.configure(0, &config()).expect("a good configuration");
    task.send(1, 0, motion());
    task.tick();
    assert!(!task.is_back(), "it waits");
    task.ticks(50);
    assert!(task.is_back());
    let mut task = Task::new(STARTED, Found::Blank);
    task.configure(0, &config()).expect("a good configuration");
    task.send(1, 0, Order::Run(Command::Stop));
    task.tick();
    assert!(task.is_back());
}

fn motion() -> Order {
    Order::Run(Command::Position(1.0))
}

/// A pulse ends the search.
#[test]
fn index_pulses_reach_the_axis_whose_line_was_high() {
    let mut task = ready();
    referenced(&mut task, [false, true]);
    let told = records(&mut task).map(|record| record.referenced);
    assert_eq!(told, [Referenced::Searching, Referenced::Yes]);
}

/// A motor of rated speed at nominal supply, with a time constant of 40 ms.
fn estimates() -> Estimates {
    let trusted = |value| Estimate { value, u95: 900, standing: Standing::Trusted };
    Estimates { gain: trusted(1 << 20), time_constant: trusted(400 << 12), ..Estimates::default() }
}

/// Both axes search for their index; these lines are high.
fn referenced(task: &mut Task, index: [bool; AXES]) {
    for axis in 0..AXES as u8 {
        task.run(axis, Command::Adopt(estimates())).expect("at rest");
        task.run(axis, Command::Arm).expect("at rest");
        let how = Referencing::Index { speed_rad_s: 1.0, position_rad: 0.0, reach_rad: 7.0 };
        task.run(axis, Command::Reference(how)).expect("armed");
    }
    // At 1 rad/s, 0.064 counts a tick.
    for _ in 0..20 {
        task.world.samples.iter_mut().for_each(|sample| sample.count += 1);
        task.ticks(16);
    }
    task.world.index = index;
    task.tick();
    task.world.index = [false; AXES];
}

#[test]
fn telemetry_comes_every_so_many_ticks_with_what_the_step_of_its_axis_took() {
    let mut task = ready();
    task.run(1, Command::Subscribe { every: 5 }).expect("a service");
    while task.records.dequeue().is_some() {}
    task.ticks(25);
    let told: Vec<Message> = std::iter::from_fn(|| task.records.dequeue()).map(Message::from).collect();
    let seen: Vec<(u8, u32, u32)> = told
        .iter()
        .map(|message| match *message {
            Message::Telemetry { axis, tick, cost, .. } => (axis, tick, cost),
            ref other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(seen.len(), 5);
    assert!(seen.iter().all(|(axis, tick, cost)| *axis == 1 && tick % 5 == 0 && *cost == LOOK), "{seen:?}");
    assert!(seen.windows(2).all(|pair| pair[1].1 == pair[0].1 + 5));
}

#[test]
fn a_capture_records_the_axis_for_which_it_was_armed_and_is_read_piece_by_piece() {
    let mut task = ready();
    task.run(1, Command::CaptureArm { trigger: Trigger::Now, before: 0 }).expect("no save is under way");
    task.world.samples[1].count = 40;
    task.ticks(1_100);
    task.send(9, 0, Order::Run(Command::CaptureRead(7)));
    task.tick();
    let told = task.told();
    match &told[0] {
        Message::Captured { axis: 1, stage: Stage::Done, extent, from: 7, shots } => {
            assert_eq!((extent.length, shots.len()), (1024, 5));
            assert!(shots.iter().all(|shot| shot.count == 40));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_was_found_at_power_up_is_told_at_once_and_again_when_asked() {
    let (cause, stored) = (ResetCause::Watchdog, Found::Unreadable { layout: 3 });
    let started = Started { cause, clock: Clock::Internal, brown_out_reset_off: true };
    let mut board = Board {
        name: NAME,
        scales: Fields::SCALES,
        clock: Clock::Internal,
        brown_out_reset_off: true,
        gates: Some(Gates { state: State::Ready, trouble: 0 }),
        zeros: [ZEROS[0], ZEROS[1], NOT_SENSED, NOT_SENSED],
    };
    let mut task = Task::new(started, stored);
    assert_eq!(task.told().first(), Some(&Message::Hello { axes: AXES as u8, cause, stored, board }));
    // Zeros and gate drivers are told as they are when somebody asks.
    let trouble = GateTrouble { driver: 1, trouble: Trouble::LineLow }.code();
    board.gates = Some(Gates { state: State::Failed, trouble });
    board.zeros[1] = [2_050, Sample::CURRENT_ZERO_UNSTEADY];
    (task.world.gates, task.world.zeros[1]) = (board.gates, board.zeros[1]);
    task.send(5, 1, Order::Run(Command::Hello));
    task.tick();
    assert_eq!(task.told()[0], Message::Hello { axes: AXES as u8, cause, stored, board });
    task.send(6, 0, Order::Run(Command::Parameters));
    task.tick();
    assert_eq!(task.told()[0], Message::Parameters { axis: 0, parameters: None });
}

#[test]
fn the_end_of_a_commissioning_is_told_for_its_axis() {
    let mut task = ready();
    task.run(1, Command::Arm).expect("at rest");
    task.run(1, Command::Commission { budget_ms: 5_000, seed: 1 }).expect("armed");
    task.ticks(50);
    task.send(1, 1, Order::Run(Command::Stop));
    task.ticks(5);
    let ended = task.told().into_iter().filter(|told| matches!(told, Message::Commissioned { axis: 1, .. }));
    assert_eq!(ended.count(), 1);
}

// ── Saving ──────────────────────────────────────────────────────────────────────────────────────────────────────────

/// Runs ticks until a job waits, and takes it.
fn job(task: &mut Task, most: u32) -> (Job, u32) {
    for ticks in 1..=most {
        task.tick();
        if let Some(job) = task.jobs.dequeue() {
            return (job, ticks);
        }
    }
    panic!("no job in {most} ticks")
}

/// A save that has come to its report.
fn saving() -> Task {
    saving_of(ready())
}

fn saving_of(mut task: Task) -> Task {
    task.run(0, Command::Save).expect("everything rests");
    // The first job may be there already.
    let mut parameters: Vec<Option<AxisParameters>> = Vec::new();
    loop {
        let next = task.jobs.dequeue().unwrap_or_else(|| job(&mut task, 3).0);
        match next {
            Job::Axis(axis) => parameters.push(axis),
            Job::Write(_) => break,
            Job::Erase(_) => panic!("nobody has asked for it"),
        }
    }
    assert_eq!(
        parameters.iter().map(|axis| axis.map(|axis| axis.config)).collect::<Vec<_>>(),
        [Some(config()); AXES]
    );
    task
}

#[test]
fn a_save_needs_every_bridge_open_and_every_shaft_at_rest() {
    for axis in 0..AXES {
        let mut task = ready();
        task.run(axis as u8, Command::Arm).expect("at rest");
        task.run(axis as u8, Command::Voltage(2.0)).expect("armed");
        task.ticks(5);
        assert_eq!(task.run(0, Command::Save), Err(Refusal::NotAtRest), "axis {axis} drives");
        let mut task = ready();
        for _ in 0..200 {
            task.world.samples[axis].count += 3;
            task.tick();
        }
        assert_eq!(task.run(0, Command::Save), Err(Refusal::NotAtRest), "shaft {axis} turns");
        assert!(!task.jobs.ready());
    }
}

#[test]
fn while_parameters_are_stored_ticks_may_be_late_and_nothing_but_a_stop_is_carried_out() {
    let mut task = saving();
    task.world.late = true;
    for command in [Command::Arm, Command::Compensation(true)] {
        assert_eq!(task.run(1, command), Err(Refusal::Storing));
    }
    assert_eq!(task.configure(1, &config()), Err(Refusal::Storing));
    for command in [Command::Save, Command::CaptureArm { trigger: Trigger::Now, before: 0 }] {
        assert_eq!(task.run(1, command), Err(Refusal::Storing));
    }
    task.run(1, Command::Stop).expect("always");
    task.run(1, Command::Hello).expect("always");
    assert!(task.reports.enqueue(Report::Saved).is_ok());
    task.tick();
    assert!(task.told().contains(&Message::Store(StoreEvent::Saved)));
    task.world.late = false;
    assert_eq!(faults(&mut task), [Fault::None; AXES]);
    task.run(1, Command::Arm).expect("it is over");
}

/// 25 ms: the announcement has left the line before the processor stands still.
#[test]
fn an_erase_is_announced_25_ms_ahead_and_counters_that_go_round_lose_their_reference() {
    let mut task = ready();
    referenced(&mut task, [true; AXES]);
    (0..AXES as u8).for_each(|axis| task.run(axis, Command::Stop).expect("always"));
    task.ticks(3_000);
    assert_eq!(records(&mut task).map(|record| record.referenced), [Referenced::Yes; AXES]);
    let mut task = saving_of(task);
    task.world.goes_round = [false, true];
    assert!(task.reports.enqueue(Report::EraseNeeded).is_ok());
    task.tick();
    let told = task.told();
    assert!(matches!(told[..], [Message::Store(StoreEvent::Erasing { longest_ms: 2_000.. })]), "{told:?}");
    let (erase, ticks) = job(&mut task, 400);
    assert!(matches!(erase, Job::Erase(_)));
    assert!((250..=252).contains(&ticks), "{ticks} ticks of 0.1 ms");
    assert!(task.reports.enqueue(Report::Saved).is_ok());
    task.ticks(2);
    assert_eq!(records(&mut task).map(|record| record.referenced), [Referenced::Yes, Referenced::No]);
}

#[test]
fn a_trial_whose_host_is_silent_ends_with_a_stop_and_a_new_start() {
    let mut task = ready();
    for axis in 0..AXES as u8 {
        task.run(axis, Command::Arm).expect("at rest");
        task.run(axis, Command::Voltage(3.0)).expect("armed");
    }
    task.run(1, Command::OnTrial(500)).expect("a service");
    task.ticks(498);
    // Any command shows that the host is there, and one that is refused too.
    assert_eq!(task.run(0, Command::Save), Err(Refusal::NotAtRest));
    task.ticks(498);
    assert_eq!(task.world.bridges.map(|set| set.0), [Bridge::Driven; AXES]);
    task.ticks(3);
    assert_eq!(task.world.bridges.map(|set| set.0), [Bridge::Driven, Bridge::Open]);
    task.ticks(1_000);
    assert_eq!(task.world.restarts, 0, "the other axis is driven");
    task.run(0, Command::Stop).expect("always");
    assert_eq!(task.world.restarts, 0, "the host is there again");
    task.ticks(501);
    assert!(task.world.restarts > 0);
}

#[test]
fn without_a_trial_and_while_parameters_are_stored_no_silence_starts_the_chip_anew() {
    let mut task = ready();
    task.run(1, Command::OnTrial(10)).expect("a service");
    task.run(0, Command::OnTrial(0)).expect("a service");
    task.ticks(1_000);
    task.run(1, Command::OnTrial(10)).expect("a service");
    let mut task = saving_of(task);
    task.ticks(1_000);
    assert_eq!(task.world.restarts, 0);
}

#[test]
fn without_a_configuration_the_rate_of_the_start_paces_the_announcement() {
    let mut task = Task::new(STARTED, Found::Blank);
    task.ticks(10);
    task.run(0, Command::Save).expect("everything rests");
    while !matches!(task.jobs.dequeue(), Some(Job::Write(_))) {
        task.tick();
    }
    assert!(task.reports.enqueue(Report::EraseNeeded).is_ok());
    let (_, ticks) = job(&mut task, 400);
    assert!((251..=253).contains(&ticks), "{ticks} ticks of 0.1 ms");
}

#[test]
fn a_sample_of_an_axis_reaches_that_axis() {
    let mut task = ready();
    task.world.samples[0] = Sample { count: -12, vbus_raw: 1190, current_raw: 3 };
    task.world.samples[1] = Sample { count: 1, vbus_raw: 1210, current_raw: -4 };
    let seen = records(&mut task).map(|record| (record.count, record.vbus_raw, record.current_raw));
    assert_eq!(seen, [(-12, 1190, 3), (1, 1210, -4)]);
    assert_eq!(records(&mut task).map(|record| record.activity), [Activity::Idle; AXES]);
}
