//! A table of the load over the place through the image in QEMU: the same bits on chip and host, and better tracking.

use servo::compensate::position_load::{Harmonic, Load};
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::firmware::compare;
use trials::tracking::exact;
use truing::device::session::{Done, SessionResult, Span};
use truing::device::session::{Profile, Task};

/// Rms of the position error while the profile runs, counts.
fn rms(result: &SessionResult) -> f64 {
    let Some(Done::Tracked(Span { start, hold, .. })) = result.done.last() else {
        panic!("{:?}", result.done)
    };
    let zero = result.log.rows[0].record.count;
    let rows = result.log.rows.iter().filter(|row| (*start..*hold).contains(&row.tick));
    let squares: Vec<f64> =
        rows.map(|row| (f64::from(row.record.ahead_q8(zero)) / 256.0 - 0.5).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn chip_and_host_hold_a_pendulum_with_the_same_bits() {
    let options = Options { tick_hz: 1_000, ..Options::default() };
    let mut plant = Plant::draw(Family::G3, Severity::Nominal, Seeds::Evaluation(770_000), &options);
    let motor = &mut plant.motor;
    (motor.load.mgl_nm, motor.load.gravity_phase) = (1.5 * motor.torque_constant / motor.resistance_ohm, 0.7);
    let sine = Harmonic { cycles: 1, amplitude_v: 1.5, phase_rad: 0.7 };
    let load = Load { period_counts: plant.config.counts_per_rev, constant_v: 0.0, harmonics: &[sine] };
    let table = load.build(&plant.config.build().expect("a scale")).expect("a table");
    let profile = Profile::Sine { amplitude_rad: 2.0, frequency_hz: 0.5, seconds: 6.0 };
    let track = Task::Track { profile, compensation: true };
    let known = Task::Adopt(Box::new(exact(&plant)));
    let (without, verdict) = compare(&plant, &[known.clone(), track.clone()]).expect("a session");
    assert!(verdict.identical(), "{verdict}");
    let (with, verdict) = compare(&plant, &[known, Task::PositionLoad(table), track]).expect("a session");
    assert!(verdict.identical(), "{verdict}");
    assert!(rms(&without) > 5.0 * rms(&with), "{} counts, {} with the table", rms(&without), rms(&with));
}
