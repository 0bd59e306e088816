//! Protection beside the motor: the table of actions, and what the image tells the joint.

use servo::axis::servo_axis::{Order, ServoAxis};
use servo::axis::{Bridge, Sample};
use servo::config::Config;
use servo::link::protocol::{Command, Refusal};
use servo::optional::Optional;
use servo::protect::{Action, Actions, Condition, Fault, Forbidden, Interlock};
use servo::record::Activity;
use std::ops::RangeInclusive;
use trials::simulated_servo::config;

const STANDING: Sample = Sample { count: 7, vbus_raw: 1200, current_raw: Sample::CURRENT_NOT_SENSED };

fn order(axis: &mut ServoAxis, command: Command) -> Result<(), Refusal> {
    axis.execute(&Order::of(&command)?)
}

/// A joint that applies one volt.
fn driving() -> ServoAxis {
    let mut joint = ServoAxis::new();
    for command in [Command::Configure(config()), Command::Arm, Command::Voltage(1.0)] {
        order(&mut joint, command).expect("a new joint");
        joint.step(STANDING);
    }
    assert_eq!(joint.step(STANDING).output.bridge, Bridge::Driven);
    joint
}

#[test]
fn numbers_of_faults_are_stable_and_all_are_listed() {
    let numbers: Vec<u8> = Fault::ALL.iter().map(|&fault| fault as u8).collect();
    assert_eq!(numbers, (1..=19).collect::<Vec<u8>>());
    assert_eq!((Fault::SupplyHigh as u8, Fault::Disabled as u8), (6, 19));
}

#[test]
fn the_table_opens_unless_told_otherwise_and_refuses_what_cannot_be() {
    let table = Actions::default();
    for fault in Fault::ALL {
        assert_eq!(table.of(fault), Action::Open);
        let braking = table.with(fault, Action::Brake);
        let holding = table.with(fault, Action::Hold);
        let needs_open = matches!(fault, Fault::OverCurrent | Fault::BridgeFault | Fault::Disabled);
        assert_eq!(braking.is_err(), needs_open, "{fault:?}");
        assert_eq!(holding.is_err(), fault != Fault::CommandTimeout, "{fault:?}");
        if let Ok(table) = braking {
            assert_eq!(table.of(fault), Action::Brake);
            assert_eq!(table.with(fault, Action::Brake), Ok(table), "said twice");
            assert_eq!(table.with(fault, Action::Open), Ok(Actions::default()));
        }
        if let Err(error) = holding {
            let action = Action::Hold;
            assert_eq!(error, Forbidden { fault, action });
        }
    }
    let both = table
        .with(Fault::CommandTimeout, Action::Hold)
        .and_then(|table| table.with(Fault::NoMotion, Action::Brake))
        .expect("both can be");
    assert_eq!(both.with(Fault::CommandTimeout, Action::Hold), Ok(both), "said twice");
    assert_eq!(both.of(Fault::CommandTimeout), Action::Hold);
    assert_eq!(both.of(Fault::NoMotion), Action::Brake);
    assert_eq!(both.of(Fault::Stalled), Action::Open);
}

#[test]
fn a_permission_that_is_withdrawn_opens_the_bridge_and_cannot_be_cleared_while_it_is_missing() {
    for (interlock, fault) in
        [(Interlock::Disabled, Fault::Disabled), (Interlock::BridgeFault, Fault::BridgeFault)]
    {
        let mut joint = driving();
        joint.raise(Condition::Interlock(Interlock::Granted));
        assert_eq!(joint.step(STANDING).output.bridge, Bridge::Driven);
        joint.raise(Condition::Interlock(interlock));
        let output = joint.step(STANDING).output;
        assert_eq!((output.bridge, output.record.fault), (Bridge::Open, fault));
        assert_eq!(output.record.activity, Activity::Faulted);

        order(&mut joint, Command::Stop).expect("always possible");
        joint.raise(Condition::Interlock(interlock));
        let faulted = Err(Refusal::Faulted);
        assert_eq!(order(&mut joint, Command::Arm), faulted);

        joint.step(STANDING);
        joint.raise(Condition::Interlock(Interlock::Granted));
        assert_eq!(joint.step(STANDING).output.record.fault, fault, "latched");
        order(&mut joint, Command::Stop).expect("always possible");
        assert_eq!(joint.step(STANDING).output.record.fault, Fault::None);
        assert_eq!(order(&mut joint, Command::Arm), Ok(()));
    }
}

#[test]
fn what_is_found_at_boot_waits_for_the_axis_and_for_the_explicit_clear() {
    for (notice, fault) in [
        (Condition::WatchdogReset, Fault::WatchdogReset),
        (Condition::ParametersDamaged, Fault::ParametersDamaged),
    ] {
        let mut joint = ServoAxis::new();
        joint.raise(notice);
        joint.raise(Condition::Interlock(Interlock::Disabled));
        let record = joint.step(STANDING).output.record;
        assert_eq!((record.fault, record.activity), (fault, Activity::Faulted));
        order(&mut joint, Command::Configure(config())).expect("bridge open");
        assert_eq!(joint.step(STANDING).output.record.fault, fault, "the first reason stays");
        order(&mut joint, Command::Configure(config())).expect("bridge open");
        let faulted = Err(Refusal::Faulted);
        assert_eq!(order(&mut joint, Command::Arm), faulted);
        order(&mut joint, Command::Stop).expect("always possible");
        assert_eq!(order(&mut joint, Command::Arm), Ok(()));
        assert_eq!(joint.step(STANDING).output.record.fault, Fault::None);
    }
}

/// A joint at rest with limits of current and speed, and one that reads this.
fn limited() -> ServoAxis {
    let mut joint = ServoAxis::new();
    let limits = Config {
        current_limit_a: Optional::new(1.0),
        speed_limit_rad_s: Optional::new(100.0),
        supply_low_v: Optional::new(9.0),
        supply_high_v: Optional::new(15.0),
        ..config()
    };
    order(&mut joint, Command::Configure(limits)).expect("a good one");
    (0..400).for_each(|_| _ = joint.step(RESTING));
    joint
}

const RESTING: Sample = Sample { current_raw: 0, ..STANDING };

/// Steps with samples of this kind until a fault: which, and in which tick.
fn fault_of(joint: &mut ServoAxis, most: i32, sample: impl Fn(i32) -> Sample) -> (Fault, i32) {
    for tick in 1..=most {
        let fault = joint.step(sample(tick)).output.record.fault;
        if fault != Fault::None {
            return (fault, tick);
        }
    }
    (Fault::None, most)
}

/// A fault, the ticks in which it is found, and what it is found in.
type Kind = (Fault, RangeInclusive<i32>, fn(i32) -> Sample);

/// Supply counts are 10 mV, current counts 5 mA; a tick is 0.1 ms. Supply must be beyond its limit for five milliseconds; twice
/// the current and what counts as ripple and noise, for ten.
fn beyond() -> [Kind; 5] {
    let (soon, later) = (48..=64, 100..=116);
    [
        (Fault::OverCurrent, later.clone(), |_| Sample { current_raw: 414, ..RESTING }),
        (Fault::OverCurrent, later, |_| Sample { current_raw: -414, ..RESTING }),
        (Fault::SupplyLow, soon.clone(), |_| Sample { vbus_raw: 895, ..RESTING }),
        (Fault::SupplyHigh, soon.clone(), |_| Sample { vbus_raw: 1505, ..RESTING }),
        (Fault::SupplyNotMeasured, soon, |_| Sample { vbus_raw: Sample::VBUS_NOT_MEASURED, ..RESTING }),
    ]
}

#[test]
fn what_is_beyond_its_limit_for_five_or_ten_milliseconds_is_a_fault() {
    for (fault, when, sample) in beyond() {
        let (found, ticks) = fault_of(&mut limited(), 200, sample);
        assert_eq!(found, fault);
        assert!(when.contains(&ticks), "{fault:?} after {ticks} ticks");
        let shorter = when.start() - 8;
        assert_eq!(fault_of(&mut limited(), shorter, sample), (Fault::None, shorter));
    }
    // A sixteenth above the limit of 200 counts is ripple, two more counts are noise.
    let within = [
        Sample { current_raw: 214, ..RESTING },
        Sample { current_raw: -214, ..RESTING },
        Sample { vbus_raw: 905, ..RESTING },
        Sample { vbus_raw: 1495, ..RESTING },
    ];
    for sample in within {
        assert_eq!(fault_of(&mut limited(), 500, |_| sample), (Fault::None, 500), "{sample:?}");
    }
    // An eighth above it lasts 5,000 / 11 looks of four ticks.
    let (found, ticks) = fault_of(&mut limited(), 2_000, |_| Sample { current_raw: 225, ..RESTING });
    assert_eq!(found, Fault::OverCurrent);
    assert!((1_800..=1_840).contains(&ticks), "{ticks} ticks");
}

/// The speed limit, and without one what no voltage of the supply explains.
#[test]
fn a_shaft_that_is_too_fast_is_told_by_its_limit_and_without_one_by_what_the_motor_can_be() {
    // 95 and 105 rad/s at the controlled shaft, behind a gear of 10; slowly up to it.
    let per_tick = |rad_s: f32| rad_s * 4000.0 / std::f32::consts::TAU / 10_000.0;
    let turning = |rad_s: f32| {
        move |tick: i32| {
            let ticks = tick as f32;
            let way = if ticks < 2_000.0 { ticks * ticks / 4_000.0 } else { ticks - 1_000.0 };
            Sample { count: (way * per_tick(rad_s)) as i32, ..RESTING }
        }
    };
    let unlimited = || {
        let mut joint = ServoAxis::new();
        order(&mut joint, Command::Configure(config())).expect("a good one");
        (0..400).for_each(|_| _ = joint.step(RESTING));
        joint
    };
    for sign in [1.0, -1.0] {
        assert_eq!(fault_of(&mut limited(), 4_000, turning(95.0 * sign)).0, Fault::None);
        let (fault, tick) = fault_of(&mut limited(), 4_000, turning(105.0 * sign));
        assert_eq!(fault, Fault::Overspeed);
        // 100 of 105 rad/s in tick 1,905, five milliseconds, and the lag of the estimate.
        assert!((1_950..2_000).contains(&tick), "tick {tick}");
        // Twice the rated 125 rad/s.
        assert_eq!(fault_of(&mut unlimited(), 4_000, turning(240.0 * sign)).0, Fault::None);
        assert_eq!(fault_of(&mut unlimited(), 4_000, turning(262.0 * sign)).0, Fault::Runaway);
    }
}

/// Four milliseconds before a `Stop` and four behind it are not eight.
#[test]
fn a_stop_forgets_what_only_looked_like_a_fault() {
    for (fault, when, sample) in beyond() {
        let (mut joint, shorter) = (limited(), when.start() - 8);
        assert_eq!(fault_of(&mut joint, shorter, sample), (Fault::None, shorter));
        order(&mut joint, Command::Stop).expect("always");
        assert_eq!(fault_of(&mut joint, shorter, sample), (Fault::None, shorter), "{fault:?}");
        assert_eq!(fault_of(&mut joint, 40, sample).0, fault);
    }
}

#[test]
fn a_tick_that_overruns_opens_the_bridge() {
    let mut joint = driving();
    joint.raise(Condition::TickOverrun);
    let output = joint.step(STANDING).output;
    assert_eq!((output.bridge, output.record.fault), (Bridge::Open, Fault::TickOverrun));
    assert_eq!(Condition::behind(Fault::TickOverrun), Some(Condition::TickOverrun));
    assert_eq!(Condition::behind(Fault::NoMotion), None);
}
