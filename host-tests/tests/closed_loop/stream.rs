//! Streamed set-points: as good as a motion that the chip knows by itself, never beyond the limits, safe when the stream
//! ends or stalls.

use proptest::prelude::*;
use servo::axis::Command;
use servo::axis::{Bridge, Output, Refusal};
use servo::motion::stream::Point;
use servo::motion::trajectory::Limits;
use servo::protect::Fault;
use servo::record::{Activity, Advisory, Limit};
use std::f64::consts::TAU;
use trials::bench::Bench;
use trials::families::{Family, Options, Plant, Seeds, Severity};
use trials::tracking::knowing;
use truing::device::waypoints::{self, Knot, Waypoint};

fn point(knot: &Knot, before: u32) -> Command {
    Command::Stream(Point {
        position_rad: knot.theta_rad as f32,
        speed_rad_s: knot.omega_rad_s as f32,
        acceleration_rad_s2: knot.alpha_rad_s2.map(|alpha| alpha as f32),
        ticks: knot.tick - before,
    })
}

/// Streams the points as early as there is room, up to `ticks`; `watch` sees every tick with its number.
fn stream(bench: &mut Bench, knots: &[Knot], ticks: u32, mut watch: impl FnMut(u32, &Output, &Bench)) {
    let mut next = 1;
    for tick in 0..ticks {
        while next < knots.len() {
            match bench.ask(point(&knots[next], knots[next - 1].tick)) {
                Ok(()) => next += 1,
                Err(Refusal::StreamFull) => break,
                Err(refusal) => panic!("{:?}: {refusal:?}", knots[next]),
            }
        }
        let output = bench.tick();
        watch(tick, &output, bench);
    }
}

/// Five turns with soft first and last ones, as the chip's own sine has them.
fn eased(amplitude: f64, hertz: f64, seconds: f64, t: f64) -> f64 {
    let turns = (t.min(seconds - t) * hertz).clamp(0.0, 1.0);
    let ease = turns.powi(3) * (10.0 - 15.0 * turns + 6.0 * turns * turns);
    amplitude * ease * (TAU * hertz * t).sin()
}

const TURNS: f64 = 5.0;

/// Rms of true position minus the wanted one, without the first and the last turn: the chip's own sine, and the same one
/// from a file with so many rows a second.
fn rms(plant: &Plant, share: f64, hertz: f64, rows_hz: f64) -> [f64; 2] {
    let config = plant.config;
    let tick_hz = f64::from(config.tick_hz);
    let amplitude = share * f64::from(config.rated_speed_rad_s) / (TAU * hertz);
    let seconds = TURNS / hertz;
    let ticks = (seconds * tick_hz) as u32;
    let rows: Vec<Waypoint> = (0..=(seconds * rows_hz).round() as u32)
        .map(|row| f64::from(row) / rows_hz)
        .map(|time_s| Waypoint {
            time_s,
            theta_rad: eased(amplitude, hertz, seconds, time_s),
            ..Waypoint::default()
        })
        .collect();
    let judged = (tick_hz / hertz) as u32..ticks - (tick_hz / hertz) as u32;
    let mut sums = [0.0f64; 2];
    for (streamed, sum) in sums.iter_mut().enumerate() {
        let mut bench = knowing(plant);
        let origin = bench.board.reading().theta;
        let mut count = 0;
        let mut judge = |tick: u32, output: &Output, theta: f64| {
            assert_eq!(output.record.fault, Fault::None, "{plant:?} at {tick}");
            if judged.contains(&tick) {
                let wanted = eased(amplitude, hertz, seconds, f64::from(tick) / tick_hz);
                *sum += (theta - origin - wanted).powi(2);
                count += 1;
            }
        };
        let mut theta = origin;
        if streamed == 1 {
            let knots = waypoints::knots(&rows, config.tick_hz, 8);
            stream(&mut bench, &knots, ticks, |tick, output, bench| {
                assert_eq!(output.record.limit, Limit::None, "at {tick}");
                judge(tick, output, theta);
                theta = bench.board.reading().theta;
            });
        } else {
            let sine = Command::TrackSine {
                amplitude_rad: amplitude as f32,
                frequency_hz: hertz as f32,
                duration_ms: (seconds * 1000.0) as u32,
            };
            bench.ask(sine).expect("a sine");
            for tick in 0..ticks {
                let output = bench.tick();
                judge(tick, &output, theta);
                theta = bench.board.reading().theta;
            }
        }
        *sum = (*sum / f64::from(count)).sqrt() / amplitude;
    }
    sums
}

#[test]
fn a_streamed_sine_is_followed_as_well_as_the_chips_own() {
    for (family, tick_hz, share, hertz, rows_hz) in [
        (Family::G1, 1_000, 0.2, 1.0, 100.0),
        (Family::G1, 1_000, 0.3, 2.0, 50.0),
        (Family::G2, 1_000, 0.2, 1.0, 1_000.0),
        (Family::G3, 1_000, 0.2, 1.0, 25.0),
        (Family::G2, 10_000, 0.2, 1.0, 100.0),
    ] {
        for seed in 0..3 {
            let options = Options { tick_hz, ..Options::default() };
            let plant = Plant::draw(family, Severity::Harsh, Seeds::Evaluation(500_000 + seed), &options);
            let [own, streamed] = rms(&plant, share, hertz, rows_hz);
            println!(
                "{family:?} {tick_hz} Hz, {share} of full speed at {hertz} Hz, {rows_hz} rows/s: {:.3} % own, {:.3} % streamed, {:.2}",
                100.0 * own,
                100.0 * streamed,
                streamed / own
            );
            assert!(streamed < 1.5 * own, "{family:?} {seed}: {own} {streamed}");
        }
    }
}

fn plant() -> Plant {
    let options = Options::default();
    Plant::draw(Family::G1, Severity::Nominal, Seeds::Design(41), &options)
}

/// The limits of set-points on this bench.
fn limits(bench: &mut Bench) -> Limits {
    bench.axis.design(&mut bench.state).limits
}

/// Holds every tick of the set-point against the limits.
struct Judge {
    limits: Limits,
    last: Option<(f64, f64)>,
    steepest: f64,
}

impl Judge {
    fn new(bench: &mut Bench) -> Self {
        Self { limits: limits(bench), last: None, steepest: 0.0 }
    }

    /// Counts per tick and per tick².
    fn see(&mut self, output: &Output) -> Result<(), String> {
        if output.bridge != Bridge::Driven {
            self.last = None;
            return Ok(());
        }
        let speed = f64::from(output.record.reference_speed_q20) / f64::from(1 << 20);
        let position = f64::from(output.record.reference_q8) / 256.0;
        let Limits { speed: top, voltage, tau_ticks, acceleration: hardest, .. } = self.limits;
        let top = f64::from(top.min(voltage));
        if speed.abs() > top * 1.0001 + 1e-5 {
            return Err(format!("speed {speed}, limit {top}"));
        }
        if let Some((before, place)) = self.last {
            let acceleration = speed - before;
            let asked = before.abs().max(speed.abs()) + 0.0;
            let needed = (before + f64::from(tau_ticks) * acceleration).abs();
            // Acceleration within a tick is seen as a difference: it belongs to a speed between the two.
            let room =
                f64::from(voltage) * 1.001 + acceleration.abs() + 1e-4 * f64::from(tau_ticks) + asked * 1e-3;
            if needed > room {
                return Err(format!("acceleration {acceleration} at {speed}: {needed} of {voltage}"));
            }
            if acceleration.abs() > f64::from(hardest) * 1.001 + 2e-4 {
                return Err(format!("acceleration {acceleration}, limit {hardest}"));
            }
            let moved = position - place;
            if (moved - 0.5 * (speed + before)).abs() > 0.07 + acceleration.abs() {
                return Err(format!("moved {moved} at {speed}"));
            }
            self.steepest = self.steepest.max(needed / f64::from(voltage));
        }
        self.last = Some((speed, position));
        Ok(())
    }
}

/// Points as somebody may send them who does not care for limits.
fn wild() -> impl Strategy<Value = Vec<(Point, u32)>> {
    let point = (
        -3.0f32..3.0,
        -150.0f32..150.0,
        prop::option::of(-3000.0f32..3000.0),
        prop_oneof![4..60u32, 60..400u32],
    );
    let point = point.prop_map(|(position_rad, speed_rad_s, acceleration_rad_s2, ticks)| Point {
        position_rad,
        speed_rad_s,
        acceleration_rad_s2,
        ticks,
    });
    prop::collection::vec((point, 0..300u32), 1..20)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is streamed and whenever, the set-point keeps the limits of speed, acceleration and voltage and moves as its speed
    /// says; and when nothing comes any more the axis comes to rest and holds.
    #[test]
    fn no_stream_leads_beyond_the_limits(
        points in wild(),
        speed_limit in prop::option::of(20.0f32..200.0),
        acceleration_limit in prop::option::of(200.0f32..2000.0),
    ) {
        let mut plant = plant();
        plant.config.acceleration_limit_rad_s2 = acceleration_limit.into();
        plant.config.speed_limit_rad_s = speed_limit.map(|limit| 2.0 * limit).into();
        let mut bench = knowing(&plant);
        let mut judge = Judge::new(&mut bench);
        for (point, ticks) in points {
            let _ = bench.ask(Command::Stream(point));
            for _ in 0..ticks {
                let output = bench.tick();
                prop_assume!(output.record.fault == Fault::None);
                judge.see(&output).map_err(TestCaseError::fail)?;
            }
        }
        let mut last = Output::default();
        for _ in 0..20_000 {
            last = bench.tick();
            prop_assume!(last.record.fault == Fault::None);
            judge.see(&last).map_err(TestCaseError::fail)?;
            if last.record.activity == Activity::Holding {
                break;
            }
        }
        prop_assert_eq!(last.record.activity, Activity::Holding);
        prop_assert_eq!(last.record.reference_speed_q20, 0);
    }
}

/// Points five ticks apart whose speeds lie far from each other: the acceleration swings within a tick, and the set-point took
/// 5 % more than the voltage leaves while every tick's own acceleration kept the limit.
#[test]
fn points_that_follow_each_other_at_once_keep_the_voltage() {
    let mut bench = knowing(&plant());
    let mut judge = Judge::new(&mut bench);
    let points = [(2.584_434_5, -98.039_39, 151), (2.116_771_2, -54.461_99, 5), (0.0, 0.0, 21)];
    for (position_rad, speed_rad_s, ticks) in points {
        let point = Point { position_rad, speed_rad_s, acceleration_rad_s2: None, ticks };
        let _ = bench.ask(Command::Stream(point));
    }
    for _ in 0..20_000 {
        let output = bench.tick();
        assert_eq!(output.record.fault, Fault::None);
        judge.see(&output).expect("within the limits");
    }
}

/// A sine at full swing from the first point on: nothing eases it in.
fn raw_sine(amplitude: f64, hertz: f64, seconds: f64, tick_hz: u32) -> Vec<Knot> {
    let rows: Vec<Waypoint> = (0..=(seconds * 100.0) as u32)
        .map(|row| f64::from(row) / 100.0)
        .map(|time_s| Waypoint {
            time_s,
            theta_rad: amplitude * (TAU * hertz * time_s).sin(),
            ..Waypoint::default()
        })
        .collect();
    waypoints::knots(&rows, tick_hz, 8)
}

#[test]
fn a_stream_that_stalls_slows_down_to_rest_and_says_so() {
    let plant = plant();
    let mut bench = knowing(&plant);
    let mut judge = Judge::new(&mut bench);
    let knots = raw_sine(2.0, 1.0, 3.0, plant.config.tick_hz);
    // The host dies after a second: what it has sent ahead ends 50 ms later, in full motion.
    let sent = &knots[..101];
    let mut speeds = Vec::new();
    stream(&mut bench, sent, 2_000, |_, output, _| {
        judge.see(output).expect("within the limits");
        speeds.push(output.record.reference_speed_q20);
        assert_eq!(output.record.fault, Fault::None);
    });
    let end = sent[100].tick as usize;
    let per_rad = f64::from(plant.config.counts_per_rev) / TAU / f64::from(plant.config.tick_hz);
    let fastest = 2.0 * TAU * per_rad * f64::from(1 << 20);
    assert!(f64::from(speeds[end]) > 0.9 * fastest, "it moves: {}", speeds[end]);
    let rest = speeds.iter().rposition(|speed| *speed != 0).expect("it moved") + 1;
    let slowing = f64::from(rest as u32 - end as u32) / f64::from(plant.config.tick_hz);
    assert!(slowing < 0.5, "{slowing} s");
    // It only slows down.
    assert!(speeds[end..rest].windows(2).all(|pair| pair[1].abs() <= pair[0].abs()));
    let record = bench.tick().record;
    assert_eq!((record.activity, record.advisory), (Activity::Holding, Advisory::StreamRanDry));
    // Another motion is another matter.
    bench.ask(Command::Position(0.0)).expect("a move");
    assert_eq!(bench.tick().record.advisory, Advisory::None);
}

#[test]
fn a_jump_is_followed_as_fast_as_the_limits_allow_and_caught_up_with() {
    let plant = plant();
    let mut bench = knowing(&plant);
    let mut judge = Judge::new(&mut bench);
    let rows: Vec<Waypoint> = (0..=200)
        .map(|row| Waypoint {
            time_s: f64::from(row) / 100.0,
            theta_rad: if row < 50 { 0.0 } else { 1.0 },
            ..Waypoint::default()
        })
        .collect();
    let knots = waypoints::knots(&rows, plant.config.tick_hz, 8);
    let (mut limited, mut farthest, mut last) = (0, 0, Output::default());
    stream(&mut bench, &knots, 2_100, |_, output, _| {
        judge.see(output).expect("within the limits");
        limited += u32::from(output.record.limit != Limit::None);
        farthest = farthest.max(output.record.reference_q8);
        last = *output;
    });
    let one = f64::from(plant.config.counts_per_rev) / TAU;
    // A count stands for its middle.
    let [target, farthest] =
        [last.record.reference_q8, farthest].map(|q8| (f64::from(q8) / 256.0 - 0.5) / one);
    assert!((target - 1.0).abs() < 0.01, "{target}");
    assert!(farthest < 1.01, "it swings over: {farthest}");
    assert!((20..400).contains(&limited), "{limited}");
    assert!(judge.steepest > 0.9, "of the voltage: {}", judge.steepest);
    assert_eq!((last.record.activity, last.record.advisory), (Activity::Holding, Advisory::None));
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let mut plant = plant();
    plant.config.travel_limit_rad = Some([-1.0, 1.0]);
    plant.config.gear_ratio = 1.0;
    let good = Point { position_rad: 0.5, speed_rad_s: 0.0, acceleration_rad_s2: None, ticks: 500 };
    let mut bench = Bench::new(&plant);
    bench.run(0.01, |_, _| {});
    assert_eq!(bench.ask(Command::Stream(good)), Err(Refusal::NotArmed));
    let mut bench = knowing(&plant);
    // The stored parameters are set up over some ticks, and any order, refused or not, puts off what can wait.
    bench.run(0.01, |_, _| {});
    assert_eq!(bench.ask(Command::Stream(Point { ticks: 3, ..good })), Err(Refusal::OutOfRange));
    let cases = [
        (Point { position_rad: f32::NAN, ..good }, Refusal::OutOfRange),
        (Point { speed_rad_s: f32::INFINITY, ..good }, Refusal::OutOfRange),
        (Point { acceleration_rad_s2: Some(f32::NAN), ..good }, Refusal::OutOfRange),
        (Point { ticks: 3, ..good }, Refusal::OutOfRange),
        (Point { ticks: u32::MAX, ..good }, Refusal::OutOfRange),
        (Point { position_rad: 1.1, ..good }, Refusal::BeyondTravel),
        // Its end lies within the travel, the way there does not.
        (Point { position_rad: 0.9, speed_rad_s: -20.0, ..good }, Refusal::BeyondTravel),
    ];
    let before = bench.state;
    for (point, refusal) in cases {
        assert_eq!(bench.ask(Command::Stream(point)), Err(refusal), "{point:?}");
    }
    assert_eq!(format!("{:?}", bench.state), format!("{before:?}"));
    // One under way, and as many as there is room for.
    for _ in 0..=Point::ROOM {
        assert_eq!(bench.ask(Command::Stream(good)), Ok(()));
    }
    assert_eq!(bench.ask(Command::Stream(good)), Err(Refusal::StreamFull));
    let mut last = Output::default();
    bench.run(0.5 * (Point::ROOM + 1) as f64 + 0.5, |output, _| last = *output);
    assert_eq!((last.record.activity, last.record.advisory), (Activity::Holding, Advisory::None));
}
