//! Set-points: the integers follow the equations, and nothing jumps.

use servo::control::Reference;
use servo::trajectory::{SIN_ERROR, Sine, sin_cos};
use servo::units::Position;
use std::f64::consts::TAU;

#[test]
fn sine_and_cosine_are_within_their_stated_error_all_around() {
    for k in 0..1_000_003u64 {
        let phase = (k * 4294 + k / 7) as u32;
        let angle = f64::from(phase) / 2f64.powi(32) * TAU;
        let (sin, cos) = sin_cos(phase);
        let one = 2f64.powi(30);
        assert!(
            (f64::from(sin) - angle.sin() * one).abs() <= f64::from(SIN_ERROR),
            "sin at {phase}: {sin}"
        );
        assert!(
            (f64::from(cos) - angle.cos() * one).abs() <= f64::from(SIN_ERROR),
            "cos at {phase}: {cos}"
        );
    }
}

struct Point {
    position: f64,
    speed: f64,
    acceleration: f64,
}

fn point(reference: &Reference) -> Point {
    Point {
        position: reference.position.0 as f64 / 2f64.powi(32),
        speed: f64::from(reference.speed.0) / 2f64.powi(20),
        acceleration: f64::from(reference.acceleration.0) / 2f64.powi(24),
    }
}

fn run(amplitude: f32, frequency: f32, length: u32) -> Vec<Point> {
    let mut sine = Sine::plan(Position(0), amplitude, frequency, length).expect("plausible sine");
    (0..length + 10).map(|_| point(&sine.step())).collect()
}

#[test]
fn in_the_middle_it_is_the_pure_sine_with_its_own_derivatives() {
    let (amplitude, frequency, length) = (305.0, 1e-4, 50_000);
    let omega = TAU * f64::from(frequency as f32);
    for (k, p) in run(amplitude, frequency as f32, length)
        .iter()
        .enumerate()
        .take(39_000)
        .skip(11_000)
    {
        let phase = omega * k as f64;
        let (a, w) = (f64::from(amplitude), omega);
        assert!((p.position - a * phase.sin()).abs() < 3e-4 * a, "position at {k}");
        assert!(
            (p.speed - a * w * phase.cos()).abs() < 3e-4 * a * w,
            "speed at {k}"
        );
        assert!(
            (p.acceleration + a * w * w * phase.sin()).abs() < 2e-3 * a * w * w,
            "acceleration at {k}"
        );
    }
}

/// Each signal is the derivative of the one before, over the whole course with its soft ends.
#[test]
fn position_speed_and_acceleration_belong_together_from_start_to_end() {
    for (amplitude, frequency, length) in [
        (305.0, 1e-4, 50_000),
        (4000.0, 2e-3, 3_000),
        (-700.0, 5e-4, 1_500),
    ] {
        let points = run(amplitude, frequency, length);
        let w = TAU * f64::from(frequency);
        let (speed, acceleration) = (f64::from(amplitude).abs() * w, f64::from(amplitude).abs() * w * w);
        for p in points.windows(3) {
            let slope = 0.5 * (p[2].position - p[0].position);
            assert!(
                (slope - p[1].speed).abs() < 2e-3 * speed,
                "{slope} but speed {}",
                p[1].speed
            );
            let bend = 0.5 * (p[2].speed - p[0].speed);
            assert!(
                (bend - p[1].acceleration).abs() < 0.03 * acceleration,
                "{bend}, {}",
                p[1].acceleration
            );
            assert!(
                (p[1].acceleration - p[0].acceleration).abs() < 20.0 * w * acceleration,
                "jerk"
            );
        }
    }
}

#[test]
fn it_starts_and_ends_at_rest_where_it_began() {
    let points = run(305.0, 1e-4, 50_000);
    for p in [&points[0], points.last().expect("points")] {
        assert_eq!((p.position, p.speed, p.acceleration), (0.0, 0.0, 0.0));
    }
}

#[test]
fn what_cannot_be_done_is_refused() {
    let plan = |amplitude, frequency, length| Sine::plan(Position(0), amplitude, frequency, length);
    assert!(plan(9e6, 1e-4, 50_000).is_none(), "amplitude");
    assert!(plan(100.0, 0.03, 50_000).is_none(), "frequency");
    assert!(plan(100.0, 1e-4, 4_000).is_none(), "too short");
    assert!(plan(8e6, 1e-4, 50_000).is_none(), "speed");
    assert!(plan(f32::NAN, 1e-4, 50_000).is_none(), "NaN");
    assert!(plan(100.0, f32::NAN, 50_000).is_none(), "NaN");
}
