//! Set-points: the integers follow the equations, and nothing jumps.

use servo::control::Reference;
use servo::motion::sine::{SIN_ERROR, Sine, sin_cos};
use servo::motion::trajectory::{Cruise, Limits, Move};
use servo::units::{Position, Speed};
use std::f64::consts::TAU;

#[test]
fn sine_and_cosine_are_within_their_stated_error_all_around() {
    for k in 0..1_000_003u64 {
        let phase = (k * 4294 + k / 7) as u32;
        let angle = f64::from(phase) / 2f64.powi(32) * TAU;
        let (sin, cos) = sin_cos(phase);
        let one = 2f64.powi(30);
        assert!((f64::from(sin) - angle.sin() * one).abs() <= f64::from(SIN_ERROR), "sin at {phase}: {sin}");
        assert!((f64::from(cos) - angle.cos() * one).abs() <= f64::from(SIN_ERROR), "cos at {phase}: {cos}");
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
    for (k, p) in run(amplitude, frequency as f32, length).iter().enumerate().take(39_000).skip(11_000) {
        let phase = omega * k as f64;
        let (a, w) = (f64::from(amplitude), omega);
        assert!((p.position - a * phase.sin()).abs() < 3e-4 * a, "position at {k}");
        assert!((p.speed - a * w * phase.cos()).abs() < 3e-4 * a * w, "speed at {k}");
        assert!((p.acceleration + a * w * w * phase.sin()).abs() < 2e-3 * a * w * w, "acceleration at {k}");
    }
}

/// Each signal is the derivative of the one before, over the whole course with its soft ends.
#[test]
fn position_speed_and_acceleration_belong_together_from_start_to_end() {
    for (amplitude, frequency, length) in
        [(305.0, 1e-4, 50_000), (4000.0, 2e-3, 3_000), (-700.0, 5e-4, 1_500)]
    {
        let points = run(amplitude, frequency, length);
        let w = TAU * f64::from(frequency);
        let (speed, acceleration) = (f64::from(amplitude).abs() * w, f64::from(amplitude).abs() * w * w);
        for p in points.windows(3) {
            let slope = 0.5 * (p[2].position - p[0].position);
            assert!((slope - p[1].speed).abs() < 2e-3 * speed, "{slope} but speed {}", p[1].speed);
            let bend = 0.5 * (p[2].speed - p[0].speed);
            assert!((bend - p[1].acceleration).abs() < 0.03 * acceleration, "{bend}, {}", p[1].acceleration);
            assert!((p[1].acceleration - p[0].acceleration).abs() < 20.0 * w * acceleration, "jerk");
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

const LIMITS: Limits =
    Limits { acceleration: f32::MAX, jerk: f32::MAX, speed: 2.0, voltage: 1.0, tau_ticks: 400.0 };

fn course(start: &Reference, counts: f64) -> Vec<Point> {
    let target = Position((counts * 2f64.powi(32)) as i64);
    let mut course = Move::plan(start, target, &LIMITS).expect("near enough");
    let mut points = vec![point(start)];
    while !course.done() {
        points.push(point(&course.step()));
    }
    points
}

/// Largest difference between each signal and the derivative of the one before, and between neighbours.
fn check_smooth(points: &[Point]) {
    for p in points.windows(3).skip(1) {
        let slope = 0.5 * (p[2].position - p[0].position);
        assert!((slope - p[1].speed).abs() < 5e-3, "{slope} but speed {}", p[1].speed);
        let bend = 0.5 * (p[2].speed - p[0].speed);
        assert!((bend - p[1].acceleration).abs() < 2e-4, "{bend} but acceleration {}", p[1].acceleration);
    }
    for p in points.windows(2) {
        assert!((p[1].speed - p[0].speed).abs() < 0.02, "speed jumps by {}", p[1].speed - p[0].speed);
        assert!((p[1].acceleration - p[0].acceleration).abs() < 3e-4, "acceleration jumps");
    }
}

#[test]
fn a_move_from_rest_arrives_within_its_limits_and_uses_most_of_them() {
    for counts in [3.0, -40.0, 500.0, -20_000.0, 2e5] {
        let points = course(&Reference::rest(Position(0)), counts);
        check_smooth(&points);
        let last = points.last().expect("points");
        assert_eq!((last.position, last.speed, last.acceleration), (counts, 0.0, 0.0));
        let effort = |p: &Point| (p.speed + 400.0 * p.acceleration).abs();
        let most = points.iter().map(effort).fold(0.0, f64::max);
        assert!((0.6..1.001).contains(&most), "{most} of the voltage for {counts} counts");
    }
}

#[test]
fn a_move_that_is_redirected_in_motion_continues_smoothly_and_still_arrives() {
    let mut first =
        Move::plan(&Reference::rest(Position(0)), Position(2_000 << 32), &LIMITS).expect("near enough");
    let half_way = (0..1_300).map(|_| first.step()).last().expect("a set-point");
    assert!(half_way.speed.0 > 1 << 18, "in full motion: {half_way:?}");
    for counts in [-500.0, 400.0, 900.0, 4_000.0] {
        let points = course(&half_way, counts);
        check_smooth(&points);
        let last = points.last().expect("points");
        assert_eq!((last.position, last.speed, last.acceleration), (counts, 0.0, 0.0));
        let effort = |p: &Point| (p.speed + 400.0 * p.acceleration).abs();
        let most = points.iter().map(effort).fold(0.0, f64::max);
        assert!(most < 1.5, "{most} of the voltage for {counts} counts");
    }
}

#[test]
fn a_cruise_reaches_its_speed_smoothly_and_waits_for_a_shaft_that_is_held() {
    let mut cruise = Cruise::plan(&Reference::rest(Position(0)), Speed(1 << 19), &LIMITS);
    let mut position = Position(0);
    let points: Vec<Point> = (0..4_000)
        .map(|_| {
            let reference = cruise.step(position, 0);
            position = reference.position;
            point(&reference)
        })
        .collect();
    check_smooth(&points);
    let last = points.last().expect("points");
    assert_eq!((last.speed, last.acceleration), (0.5, 0.0));

    let held = position;
    let waiting = (0..4_000).map(|_| point(&cruise.step(held, 0))).last().expect("points");
    let lead = waiting.position - held.0 as f64 / 2f64.powi(32);
    assert!((lead - 64.0).abs() < 1.0, "{lead} counts ahead");
}
