//! Far from power-up, and after counts may have been lost.

use proptest::prelude::*;
use servo::axis::servo_axis::{Order, ServoAxis};
use servo::axis::{Command, Refusal, Sample};
use servo::motion::referencing::Referencing;
use servo::record::{Record, Referenced};
use servo::units::Position;
use trials::simulated_servo::config;
use truing::device::run_log::reference;

proptest! {
    /// Two thousand turns of a fine encoder are beyond what 24 bits hold: the record beside its count tells them all the same.
    #[test]
    fn a_set_point_is_told_however_far_from_power_up(
        zero: i32, far in -1_000_000_000i32..=1_000_000_000, error_q8 in -2_000_000_000i32..=2_000_000_000,
    ) {
        let count = zero.wrapping_add(far);
        let position = Position((i64::from(count) << 32).wrapping_add(i64::from(error_q8) << 24));
        let record = Record { count, reference_q8: position.relative_q8(zero), ..Record::default() };
        prop_assert_eq!(record.ahead_q8(zero), error_q8);
        let told = reference(record.reference_q8, record.count, zero);
        prop_assert_eq!(told, f64::from(far) + f64::from(error_q8) / 256.0);
    }
}

fn run(axis: &mut ServoAxis, command: Command) -> Result<(), Refusal> {
    axis.execute(&Order::Run(command))
}

fn tick(axis: &mut ServoAxis) -> Record {
    axis.step(Sample { count: 100, vbus_raw: 1200, current_raw: 0 }).output.record
}

/// A counter of 16 bits may have gone round during an erase: nobody knows where the shaft is.
#[test]
fn an_axis_that_may_have_lost_counts_has_no_reference() {
    let mut axis = ServoAxis::new();
    axis.execute(&Order::configure(&config()).expect("a good one")).expect("open");
    tick(&mut axis);
    run(&mut axis, Command::Reference(Referencing::Here { position_rad: 0.5 })).expect("idle");
    run(&mut axis, Command::Arm).expect("no fault");
    assert_eq!(tick(&mut axis).referenced, Referenced::Yes);
    run(&mut axis, Command::GoTo(0.6)).expect("it is known where that is");
    run(&mut axis, Command::Stop).expect("always");
    tick(&mut axis);
    axis.lose_reference();
    assert_eq!(tick(&mut axis).referenced, Referenced::No);
    run(&mut axis, Command::Arm).expect("no fault");
    assert_eq!(run(&mut axis, Command::GoTo(0.6)), Err(Refusal::NotReferenced));
}
