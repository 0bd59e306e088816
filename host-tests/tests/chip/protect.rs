//! Protection beside the motor: the table of actions, and what the image tells the joint.

use host_tests::simulated_servo::config;
use servo::axis::servo_axis::ServoAxis;
use servo::axis::{self, Bridge, Sample};
use servo::link::order::Order;
use servo::link::protocol::{Command, Refusal};
use servo::protect::{Action, Actions, Condition, Fault, Forbidden, Interlock};
use servo::record::Activity;

const STANDING: Sample = Sample { count: 7, vbus_raw: 1200, current_raw: Sample::CURRENT_NOT_SENSED };

fn order(axis: &mut ServoAxis, command: Command) -> Result<(), Refusal> {
    Ok(axis.execute(&Order::from_command(&command)?.for_axis()?)?)
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
        let faulted = Err(Refusal::Axis(axis::Refusal::Faulted));
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
        let faulted = Err(Refusal::Axis(axis::Refusal::Faulted));
        assert_eq!(order(&mut joint, Command::Arm), faulted);
        order(&mut joint, Command::Stop).expect("always possible");
        assert_eq!(order(&mut joint, Command::Arm), Ok(()));
        assert_eq!(joint.step(STANDING).output.record.fault, Fault::None);
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
