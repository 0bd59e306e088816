//! An axis on the host: it commissions a simulated motor and then follows a sine.
//!
//! The loop below is the same on a chip: read the encoder, step the axis, drive the bridge.

use servo::axis::{Axis, Bridge, Output, Sample, State};
use servo::config::Config;
use servo::link::protocol::Command;

#[path = "shared/motor.rs"]
mod motor;
use motor::{CONFIG, Motor};

fn main() {
    let axis = Axis::new(&CONFIG).expect("a configuration within its ranges");
    let (mut state, mut motor) = (axis.start(), Motor::default());
    run(&axis, &mut state, &mut motor, 0.1);

    order(&axis, &mut state, Command::Arm);
    order(&axis, &mut state, Command::Commission { budget_ms: 5_000, seed: 1 });
    run(&axis, &mut state, &mut motor, 6.0);
    let report = axis.report(&state).commissioning.expect("it has ended");
    assert_eq!(report.refused, None);
    println!("found a dead zone of {:.3} V and {:.3} V", volts(report.estimates.dead_zone_pos_v), volts(report.estimates.dead_zone_neg_v));

    order(&axis, &mut state, Command::TrackSine { amplitude_rad: 1.0, frequency_hz: 1.0, duration_ms: 2_000 });
    run(&axis, &mut state, &mut motor, 3.0);
    println!("and followed a sine of 1 rad");
}
