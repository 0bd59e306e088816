//! Tracking and hunting: what the compensation is worth in closed loop, everything else alike.
//!
//! A plant commissions itself (or is given the true values). From that moment on the same world runs twice, same noise,
//! same loops: without and with compensation. It tracks a sine, and afterwards stands still.

use crate::bench::{Bench, Board};
use crate::families::{Cause, Family, Options, Plant, Seeds, Severity};
use servo::axis::Command;
use servo::axis::{Axis, HOLD_BAND};
use servo::config::Config;
use servo::control::Tuning;
use servo::identify::estimate::{
    Estimate, Estimates, GAIN_FRAC, Mechanism, Standing, TIME_FRAC, VOLTAGE_FRAC,
};
use servo::protect::Fault;
use std::f64::consts::TAU;

/// Where the loops' knowledge comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knowledge {
    /// The chip's own commissioning of this length, ms.
    Identified(u32),
    /// The truth.
    Exact,
}

/// One experiment on every plant of a family.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experiment {
    /// Motors.
    pub family: Family,
    /// How real they are.
    pub severity: Severity,
    /// Control rate, Hz.
    pub tick_hz: u32,
    /// Peak speed of the sine as a share of no-load speed.
    pub speed_share: f64,
    /// Frequency of the sine, Hz.
    pub frequency_hz: f64,
    /// Loops.
    pub tuning: Tuning,
    /// What they know.
    pub knowledge: Knowledge,
}

/// Turns of a sine; the first and the last, with their soft ends, are not judged.
const TURNS: f64 = 5.0;

/// What one plant did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Rms of the position error over the amplitude, without and with compensation.
    pub rms: [f64; 2],
    /// Rms of the error of the speed estimate over the peak speed, with compensation.
    pub speed_estimate: f64,
    /// At rest after the sine, with compensation: true motion from its lowest to its highest point, counts.
    pub wander_counts: f64,
    /// … how often the counter left the hold band after it had been inside.
    pub escapes: u32,
    /// … how often the duty of a driven bridge changed its sign outside the hold band.
    pub sign_changes: u32,
    /// … changes of the duty, per second.
    pub duty_changes_per_s: f64,
    /// … error of the count at the end.
    pub final_error: i32,
    /// Any fault.
    pub fault: Fault,
}

/// Why a plant has no [`Run`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    /// The commissioning refused or did not trust what the loops need.
    Untrusted,
    /// The axis refused the motion.
    Refused,
}

impl Experiment {
    /// Runs one plant.
    pub fn run(&self, seeds: Seeds) -> Result<Run, Left> {
        let options = Options { tick_hz: self.tick_hz, ..Options::default() };
        self.run_on(&Plant::draw(self.family, self.severity, seeds, &options))
    }

    /// Runs this plant, whatever its family.
    pub fn run_on(&self, plant: &Plant) -> Result<Run, Left> {
        let bench = self.ready(plant)?;
        let without = self.track(bench.clone(), plant, false);
        let with = self.track(bench, plant, true);
        Ok(Run { rms: [without.rms[1], with.rms[1]], ..with })
    }

    /// The plant with gains in its loops, at rest.
    fn ready(&self, plant: &Plant) -> Result<Bench, Left> {
        let axis = Axis::with_tuning(&plant.config, self.tuning).expect("a valid configuration");
        let mut bench = Bench { axis, state: axis.start(), board: Board::new(plant) };
        bench.run(0.01, |_, _| {});
        match self.knowledge {
            Knowledge::Exact => axis.adopt(&mut bench.state, &exact(plant)).expect("an idle axis"),
            Knowledge::Identified(budget_ms) => {
                commission(&mut bench, budget_ms)?;
            }
        }
        Ok(bench)
    }

    fn track(&self, mut bench: Bench, plant: &Plant, compensation: bool) -> Run {
        let peak = self.speed_share * plant.truth.gain * plant.motor.drive.supply_v;
        let amplitude = peak / (TAU * self.frequency_hz);
        let seconds = TURNS / self.frequency_hz;
        let scale = Scale::of(&plant.config);
        for command in [
            Command::Arm,
            Command::Compensation(compensation),
            Command::TrackSine {
                amplitude_rad: amplitude as f32,
                frequency_hz: self.frequency_hz as f32,
                duration_ms: (seconds * 1e3) as u32,
            },
        ] {
            bench.axis.command(&mut bench.state, &command).expect("an idle axis that is ready");
        }
        let mut errors = (Mean::default(), Mean::default());
        let judged = 1.0 / self.frequency_hz..seconds - 1.0 / self.frequency_hz;
        let mut time = 0.0;
        let mut world = bench.board.reading();
        bench.run(seconds, |output, reading| {
            if judged.contains(&time) {
                let reference = f64::from(output.record.reference_q8) / 256.0 / scale.counts_per_rad;
                errors.0.add((reference - world.theta) / amplitude);
                let speed = f64::from(output.record.speed_q20) / 2f64.powi(20) * scale.rad_s_per_count;
                errors.1.add((speed - world.omega) / peak);
            }
            world = *reading;
            time += scale.tick_s;
        });
        let rest = Rest::watch(&mut bench, &scale, plant);
        Run {
            rms: [f64::NAN, errors.0.rms()],
            speed_estimate: errors.1.rms(),
            wander_counts: rest.wander,
            escapes: rest.escapes,
            sign_changes: rest.sign_changes,
            duty_changes_per_s: rest.duty_changes_per_s,
            final_error: rest.final_error,
            fault: bench.state.fault(),
        }
    }
}

/// A sine that is feasible when it is asked for; then the supply falls, and the feed-forward is clipped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shortage {
    /// Amplitude, rad.
    pub amplitude_rad: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Supply when the sine is asked for, and while it runs: shares of the plant's own.
    pub supply: [f64; 2],
}

impl Shortage {
    /// Turns of the sine.
    const TURNS: f64 = 30.0;
    /// Turns that are not judged: a clipped start throws the mean off, whatever the integrator does.
    const START: f64 = 10.0;

    /// A sine that needs 80 % of what a plant has beyond its dead zone, and a supply that falls until it needs `excess`
    /// times what is left.
    pub fn of(plant: &Plant, frequency_hz: f64, excess: f64) -> Self {
        let supply_v = plant.motor.drive.supply_v;
        let saturation = plant.truth.saturation_v.iter().flatten();
        let top = saturation.fold(supply_v, |least, &level| least.min(level));
        let width = plant.truth.dead_zone_v[0].max(plant.truth.dead_zone_v[1]);
        let needed = 0.8 * (top - width);
        Self {
            amplitude_rad: needed / feed_forward(plant, 1.0, frequency_hz),
            frequency_hz,
            supply: [1.0, (needed / excess + width) / supply_v],
        }
    }

    /// Rms of the position error over the amplitude, without and with compensation.
    ///
    /// # Panics
    /// If the axis refuses the sine or ends it with a fault.
    pub fn run(&self, plant: &Plant) -> [f64; 2] {
        [false, true].map(|compensation| self.track(plant, compensation))
    }

    fn track(&self, plant: &Plant, compensation: bool) -> f64 {
        let mut bench = Bench::new(plant);
        bench.board.supply_falls_to(self.supply[0]);
        // Until the axis believes its supply.
        bench.run(0.1, |_, _| {});
        bench.axis.adopt(&mut bench.state, &exact(plant)).expect("idle");
        let seconds = Self::TURNS / self.frequency_hz;
        for command in [
            Command::Arm,
            Command::Compensation(compensation),
            Command::TrackSine {
                amplitude_rad: self.amplitude_rad as f32,
                frequency_hz: self.frequency_hz as f32,
                duration_ms: (seconds * 1e3) as u32,
            },
        ] {
            bench.ask(command).unwrap_or_else(|refusal| panic!("{command:?}: {refusal:?}"));
        }
        bench.board.supply_falls_to(self.supply[1]);
        let scale = Scale::of(&plant.config);
        let judged = Self::START / self.frequency_hz..seconds - 1.0 / self.frequency_hz;
        let (mut errors, mut time, mut theta) = (Mean::default(), 0.0, 0.0);
        bench.run(seconds, |output, reading| {
            if judged.contains(&time) {
                let reference = f64::from(output.record.reference_q8) / 256.0 / scale.counts_per_rad;
                errors.add((reference - theta) / self.amplitude_rad);
            }
            theta = reading.theta;
            time += scale.tick_s;
        });
        assert_eq!(bench.state.fault(), Fault::None);
        errors.rms()
    }
}

/// Peak voltage behind the dead zone that a sine takes, V: `A·ω·√(1 + (ωτ)²)/K`.
pub fn feed_forward(plant: &Plant, amplitude_rad: f64, frequency_hz: f64) -> f64 {
    let omega = TAU * frequency_hz;
    amplitude_rad * omega * (omega * plant.truth.time_constant_s).hypot(1.0) / plant.truth.gain
}

/// Conversions of one configuration.
struct Scale {
    tick_s: f64,
    counts_per_rad: f64,
    rad_s_per_count: f64,
}

impl Scale {
    fn of(config: &Config) -> Self {
        let tick_s = 1.0 / f64::from(config.tick_hz);
        let counts_per_rad = f64::from(config.counts_per_rev) / TAU;
        Self { tick_s, counts_per_rad, rad_s_per_count: 1.0 / (counts_per_rad * tick_s) }
    }
}

#[derive(Default)]
struct Mean {
    squares: f64,
    number: f64,
}

impl Mean {
    fn add(&mut self, x: f64) {
        self.squares += x * x;
        self.number += 1.0;
    }

    fn rms(&self) -> f64 {
        (self.squares / self.number).sqrt()
    }
}

/// What happens at rest: twenty time constants to come to rest (2 s at least), then as long again under watch.
struct Rest {
    wander: f64,
    escapes: u32,
    sign_changes: u32,
    duty_changes_per_s: f64,
    final_error: i32,
}

impl Rest {
    fn watch(bench: &mut Bench, scale: &Scale, plant: &Plant) -> Self {
        let seconds = (20.0 * plant.truth.time_constant_s).max(2.0);
        bench.run(seconds, |_, _| {});
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut last, mut sign, mut inside) = (None, 0, false);
        let (mut escapes, mut sign_changes, mut changes, mut final_error) = (0, 0, 0u32, 0);
        bench.run(seconds, |output, reading| {
            low = low.min(reading.theta);
            high = high.max(reading.theta);
            changes += u32::from(last.is_some_and(|duty| duty != output.duty));
            last = Some(output.duty);
            final_error = output.record.count - (output.record.reference_q8 >> 8);
            let held = final_error.abs() <= HOLD_BAND;
            escapes += u32::from(inside && !held);
            inside = held;
            let now = output.duty.signum();
            sign_changes += u32::from(!held && now * sign < 0);
            sign = if now == 0 { sign } else { now };
        });
        Self {
            wander: (high - low) * scale.counts_per_rad,
            escapes,
            sign_changes,
            duty_changes_per_s: f64::from(changes) / seconds,
            final_error,
        }
    }
}

/// Lets the axis identify its motor; the seconds that are allowed for it.
pub fn commission(bench: &mut Bench, budget_ms: u32) -> Result<f64, Left> {
    for command in [Command::Arm, Command::Commission { budget_ms, seed: 1 }] {
        bench.axis.command(&mut bench.state, &command).expect("an idle axis");
    }
    let seconds = 1.3 * f64::from(budget_ms) / 1e3;
    bench.run(seconds, |_, _| {});
    let outcome = bench.axis.report(&bench.state).commissioning.ok_or(Left::Untrusted)?;
    let e = outcome.estimates;
    let trusted = [e.dead_zone_pos_v, e.dead_zone_neg_v, e.gain_rad_s_per_v, e.time_constant_s];
    if trusted.iter().all(|number| number.trusted) { Ok(seconds) } else { Err(Left::Untrusted) }
}

/// An armed bench that knows its plant.
///
/// # Panics
/// If the library refuses what it is to know.
pub fn knowing(plant: &Plant) -> Bench {
    let mut bench = Bench::new(plant);
    bench.run(0.01, |_, _| {});
    bench.axis.adopt(&mut bench.state, &exact(plant)).expect("idle");
    bench.ask(Command::Arm).expect("armed");
    bench
}

/// Estimates as a commissioning without error would bring them.
pub fn exact(plant: &Plant) -> Estimates {
    let (config, truth) = (&plant.config, &plant.truth);
    let trusted = |value: f64| Estimate { value: value.round() as i32, u95: 0, standing: Standing::Trusted };
    let volt = f64::from(1u32 << VOLTAGE_FRAC) / f64::from(config.supply_nominal_v);
    let relative = truth.gain * f64::from(config.supply_nominal_v) / f64::from(config.rated_speed_rad_s);
    let ticks = truth.time_constant_s * f64::from(config.tick_hz);
    Estimates {
        dead_zone: truth.dead_zone_v.map(|v| trusted(v * volt)),
        saturation: truth.saturation_v.map(|level| level.map_or(Estimate::default(), |v| trusted(v * volt))),
        gain_skew: 0,
        gain: trusted(relative * f64::from(1u32 << GAIN_FRAC)),
        time_constant: trusted(ticks * f64::from(1u32 << TIME_FRAC)),
        mechanism: match truth.cause {
            Cause::Friction => Mechanism::Friction,
            Cause::Input => Mechanism::InputDeadZone,
        },
    }
}

/// The value below which the share `p` of the numbers lies.
pub fn quantile(values: impl IntoIterator<Item = f64>, p: f64) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n => sorted[((n - 1) as f64 * p).round() as usize],
    }
}
