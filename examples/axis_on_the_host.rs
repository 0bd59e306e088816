//! An axis on the host: it commissions a simulated motor and then follows a sine.
//!
//! ```text
//! cargo run --example axis_on_the_host
//! ```

mod motor;

use motor::{CONFIG, Motor};
use servo::axis::{Axis, Command, State};

fn main() {
    let axis = Axis::new(&CONFIG).expect("every value within its range");
    let (mut state, mut motor) = (axis.start(), Motor::default());

    axis.command(&mut state, &Command::Arm).expect("nothing moves");
    let (budget_ms, seed) = (5_000, 1);
    axis.command(&mut state, &Command::Commission { budget_ms, seed }).expect("it is armed");
    run(&axis, &mut state, &mut motor, 6.0);
    let found = axis.report(&state).commissioning.expect("six seconds are enough");
    let dead_zone_v = found.estimates.dead_zone_pos_v;
    println!("dead zone: {:.2} V, trusted: {}", dead_zone_v.value.unwrap_or_default(), dead_zone_v.trusted);

    axis.command(&mut state, &Command::Position(3.0)).expect("it is identified");
    run(&axis, &mut state, &mut motor, 1.0);
    println!("angle: {:.2} rad", motor.angle());
}

/// The control interrupt, as often as it comes in this time: read, step, drive.
fn run(axis: &Axis, state: &mut State, motor: &mut Motor, seconds: f64) {
    for _ in 0..(seconds * f64::from(CONFIG.tick_hz)) as u32 {
        let output = axis.step(state, motor.sample());
        motor.pass(output);
    }
}
