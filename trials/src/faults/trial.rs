//! One plant, commissioned once; from then on it breaks in as many ways as wanted.

use super::clock::Clock;
use super::world::{Injury, World};
use crate::families::{Plant, Truth};
use crate::tracking::exact;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::axis::Command;
use servo::axis::{Axis, Bridge, Output, State};
use servo::commission::CommissionReport;
use servo::protect::{Fault, Settings};
use servo::record::Record;
use std::f64::consts::TAU;

/// Counts of expected motion at which the requirement's clock starts.
const START_COUNTS: f64 = 8.0;
/// Counts of expected motion within which the bridge must be open.
pub const MOST_COUNTS: f64 = 24.0;
/// Counts that show that a shaft moves.
const PROOF_COUNTS: f64 = 2.0;
/// After so many time constants, and 2 s, an injury that was not found is missed.
const PATIENCE: f64 = 20.0;

/// When it breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// At rest; then a motion is asked for.
    AtRest,
    /// Within a motion.
    InMotion,
}

/// What protection made of an injury.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// The verdict; [`Fault::None`]: not found.
    pub fault: Fault,
    /// Was the current sensed?
    pub sensed: bool,
    /// From the clock's start to the open bridge, s; 0 if the bridge was open before. `None`: the clock never started.
    pub delay_s: Option<f64>,
    /// From the injury to the open bridge, s.
    pub since_injury_s: f64,
    /// What the requirement allows, s.
    pub allowed_s: f64,
    /// Counts that the identified model expected up to the open bridge.
    pub expected_counts: f64,
    /// Counts that the shaft really made up to then.
    pub travel_counts: f64,
    /// The plant's time constant, s.
    pub tau_s: f64,
    /// Would a whole shaft have made `PROOF_COUNTS` by the time at which the bridge must be open? If not, break-away
    /// friction holds it then, and the broken one gives the same counts.
    pub decidable: bool,
}

impl Finding {
    /// Are both limits of the requirement kept?
    pub fn in_limits(&self) -> bool {
        self.fault != Fault::None
            && self.delay_s.unwrap_or(0.0) <= self.allowed_s
            && self.expected_counts <= MOST_COUNTS
    }
}

/// An axis in a world that may break.
#[derive(Clone, Debug)]
pub struct Trial {
    plant: Plant,
    axis: Axis,
    state: State,
    /// The world.
    pub world: World,
    identified: Truth,
    tick_s: f64,
}

impl Trial {
    /// A plant that knows nothing yet, standing.
    ///
    /// # Panics
    /// If the library refuses the plant or the settings.
    pub fn fresh(plant: &Plant, settings: &Settings) -> Self {
        let axis = Axis::new(&plant.config).expect("a valid plant");
        let axis = axis.protected(settings).expect("valid settings");
        let mut trial = Self {
            state: axis.start(),
            axis,
            world: World::new(plant),
            identified: plant.truth,
            tick_s: 1.0 / f64::from(plant.config.tick_hz),
            plant: plant.clone(),
        };
        trial.run(0.01, |_, _| {});
        trial
    }

    /// … commissioned by itself within this time, at rest and armed, unless there was a false alarm. Where the identifier does not trust what the loops
    /// need, they are given the truth: it is not the subject here.
    pub fn commissioned(plant: &Plant, settings: &Settings, budget_ms: u32) -> Self {
        let mut trial = Self::fresh(plant, settings);
        trial.must(Command::Arm);
        trial.must(Command::Commission { budget_ms, seed: 1 });
        let budget_s = f64::from(budget_ms) / 1e3;
        trial.run(1.3 * budget_s, |_, _| {});
        // A few need a little longer than they were given.
        for _ in 0..10 {
            if trial.axis.report(&trial.state).commissioning.is_none() {
                trial.run(0.1 * budget_s, |_, _| {});
            }
        }
        let report = trial.axis.report(&trial.state).commissioning;
        match report.and_then(|report| identified(&report, &plant.truth)) {
            Some(identified) => trial.identified = identified,
            None => trial.must(Command::Adopt(exact(plant))),
        }
        trial.run(10.0 * plant.truth.time_constant_s, |_, _| {});
        trial.warm_up();
        trial
    }

    /// A few motions back and forth, as before any fault in the life of a joint; then rest.
    fn warm_up(&mut self) {
        let tau = self.plant.truth.time_constant_s;
        let room = 0.5 * self.plant.motor.drive.supply_v - self.plant.truth.dead_zone_v[0];
        let motions = [0.6, -0.9, 0.9, -0.3, 0.0].map(|share| Command::Voltage((share * room) as f32));
        self.may(Command::Arm);
        for command in motions {
            self.may(command);
            self.run(4.0 * tau, |_, _| {});
        }
        if self.fault() == Fault::None {
            self.must(Command::Stop);
            self.run(8.0 * tau, |_, _| {});
            self.must(Command::Arm);
        }
    }

    /// The latched fault.
    pub fn fault(&self) -> Fault {
        self.state.fault()
    }

    /// The library's report.
    pub fn report(&self) -> servo::axis::Report {
        self.axis.report(&self.state)
    }

    /// A command; an answer other than yes is an error of the suite.
    ///
    /// # Panics
    /// If the axis refuses.
    pub fn must(&mut self, command: Command) {
        let answer = self.axis.command(&mut self.state, &command);
        assert_eq!(answer, Ok(()), "{command:?} after {:?}", self.state.fault());
    }

    /// A command; was it carried out?
    pub fn may(&mut self, command: Command) -> bool {
        self.axis.command(&mut self.state, &command).is_ok()
    }

    /// One tick of both.
    pub fn tick(&mut self) -> Output {
        let sample = self.world.sample();
        let output = self.axis.step(&mut self.state, sample);
        self.world.pass(output.bridge, output.duty);
        output
    }

    /// Runs for so many seconds; `watch` sees every output and the shaft's speed, rad/s.
    pub fn run(&mut self, seconds: f64, mut watch: impl FnMut(&Output, f64)) {
        for _ in 0..(seconds / self.tick_s).round() as u64 {
            let output = self.tick();
            watch(&output, self.world.reading().omega);
        }
    }

    /// One of the motions that users ask for, drawn anew; and how long it takes to come round, s.
    pub fn motion(&self, rng: &mut ChaCha8Rng) -> (Command, f64) {
        let truth = &self.plant.truth;
        let supply = self.plant.motor.drive.supply_v;
        let width = truth.dead_zone_v[0].max(truth.dead_zone_v[1]);
        let linear =
            0.85 * truth.saturation_v.map(|v| v.unwrap_or(supply)).into_iter().fold(supply, f64::min) - width;
        let share: f64 = rng.random_range(0.25..0.75);
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let (volts, tau) = (share * linear, truth.time_constant_s);
        let speed = volts * truth.gain;
        let frequency = rng.random_range(0.02..0.06) / tau;
        match rng.random_range(0..4) {
            0 => {
                let sine = Command::TrackSine {
                    amplitude_rad: (sign * speed / (TAU * frequency)) as f32,
                    frequency_hz: frequency as f32,
                    duration_ms: (8e3 / frequency) as u32,
                };
                (sine, 1.0 / frequency)
            }
            1 => (Command::Speed((sign * speed) as f32), 10.0 * tau),
            2 => (Command::Voltage((sign * volts) as f32), 10.0 * tau),
            _ => {
                let here = self.world.reading().theta;
                (Command::Position((here + sign * speed * 12.0 * tau) as f32), 6.0 * tau)
            }
        }
    }

    /// Breaks a copy of this trial, in a motion of the given seed.
    pub fn injure(&self, injury: Injury, when: When, seed: u64) -> Finding {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut trial = self.clone();
        let (command, round_s) = loop {
            let (command, round_s) = trial.motion(&mut rng);
            if when == When::AtRest {
                let mut asked = trial.clone();
                if asked.may(command) {
                    break (command, round_s);
                }
            } else if trial.may(command) {
                break (command, round_s);
            }
        };
        let mut decidable = true;
        match when {
            When::AtRest => {
                let mut whole = trial.clone();
                whole.must(command);
                decidable = whole.moves_in_time();
                trial.world.injure(injury);
                trial.must(command);
            }
            When::InMotion => {
                let begun = 4.0 * self.plant.truth.time_constant_s;
                trial.run(begun + rng.random_range(0.0..round_s), |_, _| {});
                trial.world.injure(injury);
            }
        }
        Finding { decidable, ..trial.until_open() }
    }

    /// Runs on until the bridge opens, by the requirement's clock.
    pub fn until_open(&mut self) -> Finding {
        self.timed(|state, finding| {
            if state.bridge == Bridge::Open && state.fault != Fault::None {
                finding.fault = state.fault;
            }
            finding.fault != Fault::None
        })
    }

    /// Does a whole shaft move before the requirement's limits have passed?
    fn moves_in_time(&mut self) -> bool {
        let finding = self.timed(|_, finding| {
            finding.travel_counts >= PROOF_COUNTS
                || finding.expected_counts > MOST_COUNTS
                || finding.delay_s.is_some_and(|delay| delay > finding.allowed_s)
        });
        finding.travel_counts >= PROOF_COUNTS
    }

    /// Runs on by the requirement's clock until `ends` says so.
    fn timed(&mut self, mut ends: impl FnMut(&Record, &mut Finding) -> bool) -> Finding {
        let tau_s = self.plant.truth.time_constant_s;
        let start = self.world.reading();
        let mut clock = Clock::new(&self.plant, &self.identified, start.omega);
        let full = f64::from(self.plant.config.pwm_full_scale);
        let supply = self.plant.motor.drive.supply_v;
        let counts_per_rad = f64::from(self.plant.config.counts_per_rev) / TAU;
        let mut finding = Finding {
            fault: Fault::None,
            sensed: self.plant.sensing.current,
            delay_s: None,
            since_injury_s: 0.0,
            allowed_s: (0.3 * tau_s).max(0.02),
            expected_counts: 0.0,
            travel_counts: 0.0,
            tau_s,
            decidable: true,
        };
        let ticks = ((PATIENCE * tau_s + 2.0) / self.tick_s) as u64;
        for _ in 0..ticks {
            let record = self.tick().record;
            let duty = if record.bridge == Bridge::Driven { f64::from(record.duty) } else { 0.0 };
            finding.expected_counts = clock.pass(duty / full * supply, self.tick_s);
            finding.since_injury_s += self.tick_s;
            if let Some(delay) = &mut finding.delay_s {
                *delay += self.tick_s;
            } else if finding.expected_counts >= START_COUNTS {
                finding.delay_s = Some(0.0);
            }
            let travel = (self.world.reading().theta - start.theta) * counts_per_rad;
            finding.travel_counts = finding.travel_counts.max(travel.abs());
            if ends(&record, &mut finding) {
                break;
            }
        }
        finding
    }
}

/// What the commissioning says the motor is; `None`: not trusted.
fn identified(report: &CommissionReport, truth: &Truth) -> Option<Truth> {
    let e = &report.estimates;
    let trusted = |reported: &servo::identify::estimate::Reported| {
        reported.value.filter(|_| reported.trusted).map(f64::from)
    };
    Some(Truth {
        dead_zone_v: [trusted(&e.dead_zone_pos_v)?, trusted(&e.dead_zone_neg_v)?],
        gain: trusted(&e.gain_rad_s_per_v)?,
        time_constant_s: trusted(&e.time_constant_s)?,
        ..*truth
    })
}
