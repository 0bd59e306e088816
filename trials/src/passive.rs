//! Identification in ordinary motion, with the real loops around it: learning where nothing was commissioned, and
//! following a change of load afterwards.

use crate::bench::Bench;
use crate::families::{Family, Options, Plant, Seeds, Severity};
use crate::tracking::{Left, commission};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::axis::Command;
use servo::identify::estimate::{EstimatesReport, Reason, Reported};
use servo::optional::Optional;
use servo::protect::Fault;
use std::f64::consts::TAU;

/// Frequencies of the swings, Hz.
const SWING_HZ: [f64; 2] = [0.5, 2.5];
/// Turns of a swing, at least, and its length otherwise, s; the first and the last turn grow and fall.
const LEAST_TURNS: f64 = 3.0;
const SWING_S: f64 = 3.0;
/// Longest rest between two motions, s.
const REST_S: f64 = 0.2;
/// Durations of the moves at the speed that the set-points keep to, s, and that speed as a share of no-load speed.
const MOVE_S: [f64; 2] = [0.2, 0.8];
const MOVE_SHARE: f64 = 0.5;

/// What the axis does all day.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Swings of random frequency, with this peak speed as a share of no-load speed.
    Swings(f64),
    /// Point to point over random distances, as fast as the set-points allow.
    Moves,
}

/// Ordinary motion of a plant that was never commissioned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learning {
    /// Motors.
    pub family: Family,
    /// How real they are.
    pub severity: Severity,
    /// Control rate, Hz.
    pub tick_hz: u32,
    /// What the axis does.
    pub motion: Motion,
    /// Length, s.
    pub seconds: f64,
}

/// What was learned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learned {
    /// Relative error of the dead zones; NaN: no number.
    pub dead_zone: [f64; 2],
    /// Relative half width of their intervals.
    pub u95: [f64; 2],
    /// Relative error of the gain.
    pub gain: f64,
    /// Relative error of the time constant.
    pub time_constant: f64,
    /// Both dead zones, gain and time constant are trusted.
    pub trusted: bool,
    /// Why the first dead zone that is not trusted is not.
    pub doubt: Option<Reason>,
    /// Any fault.
    pub fault: Fault,
}

impl Learned {
    fn new(report: &EstimatesReport, plant: &Plant, fault: Fault) -> Self {
        let error =
            |number: &Reported, truth: f64| number.value.map_or(f64::NAN, |x| f64::from(x) / truth - 1.0);
        let width = |number: &Reported, truth: f64| number.u95.map_or(f64::NAN, |x| f64::from(x) / truth);
        let dead_zones = [&report.dead_zone_pos_v, &report.dead_zone_neg_v];
        let needed = [dead_zones[0], dead_zones[1], &report.gain_rad_s_per_v, &report.time_constant_s];
        let truth = &plant.truth;
        Self {
            dead_zone: [0, 1].map(|side| error(dead_zones[side], truth.dead_zone_v[side])),
            u95: [0, 1].map(|side| width(dead_zones[side], truth.dead_zone_v[side])),
            gain: error(&report.gain_rad_s_per_v, truth.gain),
            time_constant: error(&report.time_constant_s, truth.time_constant_s),
            trusted: needed.iter().all(|number| number.trusted),
            doubt: dead_zones.iter().find_map(|number| number.reason),
            fault,
        }
    }
}

impl Learning {
    /// One plant. The configuration's gain and time constant are wrong by up to 30 %.
    pub fn run(&self, seeds: Seeds) -> Learned {
        let options = Options { tick_hz: self.tick_hz, ..Options::default() };
        let mut plant = Plant::draw(self.family, self.severity, seeds, &options);
        let mut dice = ChaCha8Rng::seed_from_u64(plant.seed ^ 0x6f72_6469_6e61_7279);
        let full_speed = plant.truth.gain * plant.motor.drive.supply_v;
        let hint = plant.truth.time_constant_s * dice.random_range(0.7..1.3);
        plant.config.time_constant_hint_s = Optional::new(hint as f32);
        let mut bench = Bench::new(&plant);
        bench.run(0.01, |_, _| {});
        self.motion.run(&mut bench, full_speed, self.seconds, &mut dice);
        let report = bench.state.estimates().report(bench.axis.scale());
        Learned::new(&report, &plant, bench.state.fault())
    }
}

impl Motion {
    /// Moves for so long, with short rests; ends early on a fault.
    pub fn run(self, bench: &mut Bench, full_speed: f64, seconds: f64, dice: &mut ChaCha8Rng) {
        bench.axis.command(&mut bench.state, &Command::Arm).expect("no fault is latched");
        let (mut left, mut position) = (seconds, 0.0);
        while left > 0.0 {
            let (command, duration) = match self {
                Motion::Swings(share) => swing(share * full_speed, dice),
                Motion::Moves => {
                    let duration = dice.random_range(MOVE_S[0]..MOVE_S[1]);
                    let distance = MOVE_SHARE * full_speed * duration;
                    position += if position > 0.0 { -distance } else { distance };
                    (Command::Position(position as f32), duration)
                }
            };
            // Refused: it does not rest yet, or a fault is latched.
            let begun = bench.axis.command(&mut bench.state, &command).is_ok();
            let rest = dice.random_range(0.0..REST_S);
            let wait = if begun { duration + rest } else { rest }.min(left);
            bench.run(wait, |_, _| {});
            left -= wait.max(1e-3);
        }
    }
}

fn swing(peak: f64, dice: &mut ChaCha8Rng) -> (Command, f64) {
    let frequency = dice.random_range(SWING_HZ[0].ln()..SWING_HZ[1].ln()).exp();
    let seconds = (LEAST_TURNS / frequency).max(SWING_S);
    let command = Command::TrackSine {
        amplitude_rad: (peak / (TAU * frequency)) as f32,
        frequency_hz: frequency as f32,
        duration_ms: (1e3 * seconds) as u32,
    };
    (command, seconds)
}

/// A load step while the axis turns at constant speed, after a commissioning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Following {
    /// Motors.
    pub family: Family,
    /// How real they are.
    pub severity: Severity,
    /// Control rate, Hz.
    pub tick_hz: u32,
    /// Speed as a share of no-load speed.
    pub speed_share: f64,
    /// Step as a share of the mean dead zone.
    pub load_share: f64,
}

/// How it was followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Followed {
    /// Relative error of the dead zone that is driven, before the step.
    pub before: f64,
    /// Seconds after the step until the error is within 6 % and stays there for half a second; infinite: never.
    pub within_6_percent_s: f64,
    /// Relative error at the end.
    pub after: f64,
    /// The direction that is not driven lost its trust.
    pub other_aged: bool,
    /// Any fault.
    pub fault: Fault,
}

/// Length of the commissioning, ms; when the step comes; how long it is watched, s.
const BUDGET_MS: u32 = 5_000;
const STEP_S: f64 = 12.0;
const WATCH_S: f64 = 15.0;
/// Arrived: error and how long it has to stay, s.
const ARRIVED: f64 = 0.06;
const STAYS_S: f64 = 0.5;

impl Following {
    /// One plant.
    pub fn run(&self, seeds: Seeds) -> Result<Followed, Left> {
        let options = Options { tick_hz: self.tick_hz, ..Options::default() };
        let plant = Plant::draw(self.family, self.severity, seeds, &options);
        let truth = plant.truth;
        let mean = 0.5 * (truth.dead_zone_v[0] + truth.dead_zone_v[1]);
        let loaded = truth.dead_zone_v[0] + self.load_share * mean;
        let speed = self.speed_share * truth.gain * plant.motor.drive.supply_v;
        let mut bench = Bench::new(&plant.with_load_step(STEP_S, self.load_share));
        bench.run(0.01, |_, _| {});
        let begun = commission(&mut bench, BUDGET_MS)? + 0.01;
        for command in [Command::Arm, Command::Speed(speed as f32)] {
            bench.axis.command(&mut bench.state, &command).map_err(|_| Left::Refused)?;
        }
        let volts = |bench: &Bench| {
            let report = bench.state.estimates().report(bench.axis.scale());
            report.dead_zone_pos_v.value.map_or(f64::NAN, f64::from)
        };
        bench.run(STEP_S - begun, |_, _| {});
        let before = volts(&bench) / truth.dead_zone_v[0] - 1.0;
        let (mut since, mut error) = (None, f64::NAN);
        let mut arrived = f64::INFINITY;
        let look_s = 0.01;
        for look in 1..=(WATCH_S / look_s) as u32 {
            bench.run(look_s, |_, _| {});
            let time = f64::from(look) * look_s;
            error = volts(&bench) / loaded - 1.0;
            since = (error.abs() < ARRIVED).then(|| since.unwrap_or(time));
            if let Some(start) = since.filter(|start| arrived.is_infinite() && time - start >= STAYS_S) {
                arrived = start;
            }
        }
        let known = bench.state.estimates();
        Ok(Followed {
            before,
            within_6_percent_s: arrived,
            after: error,
            other_aged: known.dead_zone[1].reason() == Some(Reason::Aged),
            fault: bench.state.fault(),
        })
    }
}
