use super::image::board::AXES;
use super::image::boot;
use super::names::ServoAxis;
use super::rig::{Fields, IMPOSSIBLE, Memory, World, world};
use servo::axis::Axis;
use servo::axis::servo_axis::Order;
use servo::axis::{Bridge, Command};
use servo::config::Config;
use servo::drivers::flash::ParameterFlash;
use servo::drivers::saving::{Archive, Job, Report};
use servo::identify::estimate::{Estimate, Reason, Standing};
use servo::link::protocol::ResetCause;
use servo::protect::Fault;
use servo::store::{AtRest, AxisParameters, Found, LAYOUT};
use std::mem::MaybeUninit;

/// Stores axis 1 alone.
fn stored(config: Config) -> Memory {
    let memory = Memory::blank();
    let mut archive = Archive::<_, AXES>::new(ParameterFlash::new(memory.clone(), 0));
    archive.load();
    archive.forget();
    let mut axis = servo::axis::servo_axis::ServoAxis::new();
    axis.execute(&Order::configure(&config).expect("a good one")).expect("open");
    let parameters: AxisParameters = axis.parameters().expect("configured");
    assert_eq!(archive.handle(&Job::Axis(None)), None);
    assert_eq!(archive.handle(&Job::Axis(Some(parameters))), None);
    let rest = AtRest::check(Bridge::Open, true).expect("at rest");
    let report = match archive.handle(&Job::Write(rest)) {
        Some(Report::EraseNeeded) => archive.handle(&Job::Erase(rest)),
        other => other,
    };
    assert_eq!(report, Some(Report::Saved));
    memory
}

/// A record has room for numbers that are trusted, and for the reasons of the others.
#[test]
fn of_an_estimate_that_is_not_trusted_the_reason_alone_is_stored() {
    let mut archive = Archive::<_, AXES>::new(ParameterFlash::new(Memory::blank(), 0));
    let mut axis = servo::axis::servo_axis::ServoAxis::new();
    axis.execute(&Order::configure(&Config::EXAMPLE).expect("a good one")).expect("open");
    let mut parameters: AxisParameters = axis.parameters().expect("configured");
    let estimate = |standing| Estimate { value: 1 << 20, u95: 900, standing };
    parameters.estimates.gain = estimate(Standing::Trusted);
    parameters.estimates.time_constant = estimate(Standing::Doubtful(Reason::Aged));
    assert_eq!(archive.handle(&Job::Axis(Some(parameters))), None);
    let kept = archive.set().axes[0].expect("an axis").estimates;
    assert_eq!(kept.gain, parameters.estimates.gain);
    assert_eq!(kept.time_constant, Estimate::missing(Reason::Aged));
}

/// What the image finds and makes of it.
fn start(memory: Memory, cause: ResetCause) -> (Found, [&'static mut ServoAxis; AXES], World) {
    let mut archive = Archive::new(ParameterFlash::new(memory, 0));
    let found = boot::restore::<Fields>(&mut archive);
    let places = Box::leak(Box::new([const { MaybeUninit::uninit() }; AXES]));
    let mut drive = world();
    let axes = boot::axes::<Fields>(places, &mut archive, found, cause, &mut drive);
    assert!(archive.set().axes.is_empty(), "ready for the next save");
    (found, axes, drive)
}

/// The fault that an axis has once it is configured.
fn fault(axis: &mut ServoAxis) -> Fault {
    if axis.config().is_none() {
        let constants = Axis::new(&Config::EXAMPLE).expect("a good one").into();
        axis.carry_out(&Order::Install(constants, None)).expect("open");
    }
    axis.record().fault
}

#[test]
fn axes_come_up_as_they_were_stored_and_the_board_with_them() {
    let config = Config { counts_per_rev: 4321, ..Config::EXAMPLE };
    let (found, axes, drive) = start(stored(config), ResetCause::Power);
    assert_eq!(found, Found::Set { layout: LAYOUT });
    let configs = axes.each_ref().map(|axis| axis.config().copied());
    assert_eq!(configs, [None, Some(config)]);
    assert_eq!(drive.configured, [(1, config)]);
    assert_eq!(axes.map(fault), [Fault::None; AXES]);
}

#[test]
fn a_reset_by_the_watchdog_is_a_fault_of_every_axis_until_a_stop() {
    for memory in [Memory::blank(), stored(Config::EXAMPLE)] {
        let (_, axes, _) = start(memory, ResetCause::Watchdog);
        for axis in axes {
            assert_eq!(fault(axis), Fault::WatchdogReset);
            axis.carry_out(&Order::Run(Command::Stop)).expect("always");
            assert_eq!(fault(axis), Fault::None);
        }
    }
    for cause in [ResetCause::Power, ResetCause::Pin, ResetCause::Software] {
        let (found, axes, drive) = start(Memory::blank(), cause);
        assert_eq!(found, Found::Blank);
        assert!(drive.configured.is_empty());
        assert_eq!(axes.map(fault), [Fault::None; AXES]);
    }
}

#[test]
fn damaged_parameters_are_a_fault_of_every_axis() {
    let memory = stored(Config::EXAMPLE);
    memory.0.borrow_mut().iter_mut().step_by(7).for_each(|byte| *byte &= 0x5A);
    let (found, axes, drive) = start(memory, ResetCause::Power);
    assert_eq!(found, Found::Damaged);
    assert!(drive.configured.is_empty());
    assert_eq!(axes.map(fault), [Fault::ParametersDamaged; AXES]);
}

#[test]
fn a_set_that_this_board_cannot_run_is_unreadable_and_configures_nothing() {
    let config = Config { pwm_full_scale: IMPOSSIBLE, ..Config::EXAMPLE };
    let (found, axes, drive) = start(stored(config), ResetCause::Power);
    assert_eq!(found, Found::Unreadable { layout: LAYOUT });
    assert!(drive.configured.is_empty());
    assert!(axes.iter().all(|axis| axis.config().is_none()));
    assert_eq!(axes.map(fault), [Fault::None; AXES]);
}
