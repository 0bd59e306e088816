//! Commissionings of motors that are wired, described or driven wrongly: what is said about them, and how far they turn.

use crate::families::Plant;
use crate::firmware::qemu;
use crate::virtual_motor::VirtualMotor;
use servo::axis::{Axis, Bridge, Command, Output, Sample};
use servo::commission::{CommissionReport, Phase};
use servo::config::Config;
use servo::identify::estimate::Reason;
use servo::protect::Fault;
use servo::record::Record;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex};
use truing::device::link::Lockstep;
use truing::device::motor::{Drive, Motor, Reading};
use truing::device::session::{self, Task};
use truing::text::input_error::InputError;

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Flaw {
    /// Nothing.
    None,
    /// One channel of the encoder is dead from this time on, s, and the counter takes every edge for a step forwards.
    CountsUp(f64),
    /// The same, and the counter goes to and fro by one.
    Flickers(f64),
    /// The direction wire of the drive is off from this time on: it turns this way, whatever the sign.
    DirectionWire(f64, f64),
    /// The drive turns the other way from this time on.
    DriveFlips(f64),
    /// The encoder counts the other way from this time on.
    EncoderFlips(f64),
    /// The axis file holds so many times the counts of a turn.
    Counts(f64),
    /// Half of the bridge is weak: voltages of this sign act by this share; 0: not at all.
    Side(f64, f64),
    /// The drive gives nothing below this share of the full duty.
    Threshold(f64),
    /// The supply is so many times nominal.
    Supply(f64),
    /// Rated speed stands in the axis file in rpm.
    Rpm,
}

impl Flaw {
    /// What the firmware is told.
    pub fn told(self, plant: &Plant) -> Config {
        let mut config = plant.config;
        match self {
            Self::Counts(factor) => {
                config.counts_per_rev = (f64::from(config.counts_per_rev) * factor).round() as u32;
            }
            Self::Rpm => {
                config.rated_speed_rad_s = (config.rated_speed_rad_s * (60.0 / TAU) as f32).min(5_000.0);
            }
            _ => {}
        }
        config
    }

    fn duty(self, duty: f64, now: f64) -> f64 {
        match self {
            Self::DirectionWire(way, at) if now >= at => way * duty.abs(),
            Self::DriveFlips(at) if now >= at => -duty,
            Self::Side(side, share) if duty * side > 0.0 => share * duty,
            Self::Threshold(least) if duty.abs() < least => 0.0,
            Self::Supply(share) => share * duty,
            _ => duty,
        }
    }
}

/// What the shaft did while the flaw showed: not while a direction is driven in which all is well.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// When, s since power-up.
    pub since_s: Option<f64>,
    /// How long the bridge drove on, s.
    pub driven_s: f64,
    /// How far the shaft turned meanwhile, turns up and down added.
    pub turns: f64,
}

impl Shown {
    /// Within a turn or 0.3 s?
    pub fn is_soon_over(&self) -> bool {
        self.turns <= 1.0 || self.driven_s <= 0.3
    }
}

/// A motor with a flaw, in lock-step with library or image.
pub struct FlawedMotor {
    motor: VirtualMotor,
    flaw: Flaw,
    counts_per_rev: f64,
    now: f64,
    last: i32,
    count: i32,
    frozen: Option<i32>,
    shown: Arc<Mutex<Shown>>,
}

impl FlawedMotor {
    /// At rest.
    pub fn new(plant: &Plant, flaw: Flaw) -> Self {
        Self {
            motor: VirtualMotor::new(plant),
            flaw,
            counts_per_rev: f64::from(plant.config.counts_per_rev),
            now: 0.0,
            last: 0,
            count: 0,
            frozen: None,
            shown: Arc::default(),
        }
    }

    /// What it will have shown.
    pub fn shown(&self) -> Arc<Mutex<Shown>> {
        self.shown.clone()
    }

    /// What the counter shows.
    fn counted(&mut self, count: i32) -> i32 {
        let moved = count.wrapping_sub(std::mem::replace(&mut self.last, count));
        match self.flaw {
            Flaw::CountsUp(at) if self.now >= at => self.count += moved.abs(),
            Flaw::EncoderFlips(at) if self.now >= at => self.count -= moved,
            Flaw::Flickers(at) if self.now >= at => {
                let frozen = *self.frozen.get_or_insert(self.count - count % 2);
                self.count = frozen + count % 2;
            }
            _ => self.count += moved,
        }
        self.count
    }

    fn note(&mut self, drive: &Drive, duty: f64, moved: i32) {
        let driven = drive.bridge == Bridge::Driven;
        let turned = driven && f64::from(drive.duty) * duty < 0.0 && duty.abs() > 0.005;
        let misled = self.count.abs_diff(self.last) >= 2
            && match self.flaw {
                Flaw::CountsUp(_) => moved < 0,
                Flaw::Flickers(_) | Flaw::EncoderFlips(_) => true,
                _ => false,
            };
        let mut shown = self.shown.lock().expect("nobody panics with it");
        if turned || misled {
            shown.since_s = shown.since_s.or(Some(self.now));
            if driven {
                shown.driven_s += f64::from(drive.tick_s);
                shown.turns += f64::from(moved.abs()) / self.counts_per_rev;
            }
        }
    }
}

impl Motor for FlawedMotor {
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError> {
        self.now += f64::from(drive.tick_s);
        let duty = self.flaw.duty(f64::from(drive.duty), self.now);
        let mut reading = self.motor.pass(&Drive { duty: duty as f32, ..*drive })?;
        let moved = reading.count.wrapping_sub(self.last);
        reading.count = self.counted(reading.count);
        self.note(drive, duty, moved);
        if let Flaw::Supply(share) = self.flaw {
            reading.supply_v *= share as f32;
        }
        Ok(reading)
    }
}

/// How one commissioning went.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What the library says.
    pub report: Option<CommissionReport>,
    /// From the command to its end, s; the time that was waited for it where it has not ended.
    pub took_s: f64,
    /// What the shaft did after the flaw had shown.
    pub shown: Shown,
    /// The fault that protection has latched.
    pub fault: Fault,
    /// Had both directions started before the flaw came?
    pub learning: bool,
}

impl Trial {
    /// The reason of the refusal, or those of the numbers that are not trusted.
    pub fn reasons(&self) -> Vec<Reason> {
        let Some(report) = &self.report else { return Vec::new() };
        let numbers = &report.estimates;
        let doubts = [numbers.gain_rad_s_per_v, numbers.dead_zone_pos_v, numbers.dead_zone_neg_v];
        match report.refused {
            Some(reason) => vec![reason],
            None => doubts.iter().filter_map(|number| number.reason).collect(),
        }
    }
}

/// Commissions this motor through the library; no longer than four times the budget.
///
/// # Panics
/// If the library refuses the configuration or the commands.
pub fn commission(plant: &Plant, flaw: Flaw, budget_s: f64, seed: u32) -> Trial {
    let config = flaw.told(plant);
    let axis = Axis::new(&config).unwrap_or_else(|error| panic!("{error:?}: {config:?}"));
    let mut state = axis.start();
    let mut motor = FlawedMotor::new(plant, flaw);
    let tick_s = 1.0 / f64::from(config.tick_hz);
    let (mut sample, mut waiting) = (sample(&config, &at_rest(plant, flaw)), Output::default());
    let (mut took, mut outcome, mut learning, mut fault) = (0u32, None, false, Fault::None);
    for tick in 0..(4.0 * budget_s / tick_s) as u32 {
        if tick == 20 && axis.command(&mut state, &Command::Arm).is_ok() {
            let command = Command::Commission { budget_ms: (budget_s * 1e3) as u32, seed };
            axis.command(&mut state, &command).expect("an armed axis at rest");
        }
        let output = axis.step(&mut state, sample);
        let acting = std::mem::replace(&mut waiting, output);
        sample = pass(&mut motor, &config, tick, &acting);
        if motor.shown.lock().expect("nobody panics with it").since_s.is_none() {
            learning |= is_learning(&output.record);
        }
        took = tick.saturating_sub(20);
        outcome = axis.report(&state).commissioning;
        fault = output.record.fault;
        let ended = outcome.is_some() || tick >= 20 && fault != Fault::None;
        if ended && acting.bridge == Bridge::Open {
            break;
        }
    }
    let shown = *motor.shown.lock().expect("nobody panics with it");
    Trial { report: outcome, took_s: f64::from(took) * tick_s, shown, fault, learning }
}

/// The same through the image in QEMU.
///
/// # Panics
/// If the session breaks.
pub fn commission_image(plant: &Plant, flaw: Flaw, budget_s: f64, seed: u32) -> Trial {
    let config = flaw.told(plant);
    let motor = FlawedMotor::new(plant, flaw);
    let shown = motor.shown();
    let wire = Lockstep::start(&qemu(), Box::new(motor), config).expect("QEMU");
    let tasks = [Task::Commission { budget_s, seed }];
    let (rows, outcome, took_ticks) = match session::run(Box::new(wire), config, 1, &tasks, &mut |_| {}) {
        Ok(result) => {
            let outcome = result.log.outcomes.first().map(|(_, outcome)| *outcome);
            (result.log.rows, outcome, outcome.map_or(0, |outcome| outcome.duration_ticks))
        }
        // The axis was not armed: a fault says why.
        Err(error) => panic!("{error:?}"),
    };
    let shown = *shown.lock().expect("nobody panics with it");
    let tick_s = 1.0 / f64::from(config.tick_hz);
    let until = shown.since_s.map_or(usize::MAX, |since| (since / tick_s) as usize);
    let scale = config.build().expect("it was accepted");
    Trial {
        report: outcome.map(|outcome| outcome.report(&scale)),
        took_s: f64::from(took_ticks) * tick_s,
        shown,
        fault: rows
            .iter()
            .map(|row| row.record.fault)
            .find(|&fault| fault != Fault::None)
            .unwrap_or_default(),
        learning: rows.iter().take(until).any(|row| is_learning(&row.record)),
    }
}

fn is_learning(record: &Record) -> bool {
    let phases = [Phase::Learn, Phase::Coast, Phase::Saturate, Phase::Verify, Phase::Decide];
    phases.iter().any(|&phase| record.phase == phase as u8)
}

fn at_rest(plant: &Plant, flaw: Flaw) -> Reading {
    let share = if let Flaw::Supply(share) = flaw { share as f32 } else { 1.0 };
    let supply_v = if plant.sensing.vbus { plant.config.supply_nominal_v * share } else { f32::NAN };
    let current_a = if plant.sensing.current { 0.0 } else { f32::NAN };
    Reading { count: 0, current_a, supply_v, flags: 0 }
}

fn pass(motor: &mut FlawedMotor, config: &Config, tick: u32, acting: &Output) -> Sample {
    let duty = f32::from(acting.duty) / f32::from(config.pwm_full_scale as i16);
    let drive = Drive { tick, duty, bridge: acting.bridge, tick_s: 1.0 / config.tick_hz as f32 };
    sample(config, &motor.pass(&drive).expect("a simulation goes on"))
}

fn sample(config: &Config, reading: &Reading) -> Sample {
    let sensed = |value: f32, per_lsb: f32| value.is_finite().then(|| (value / per_lsb).round());
    let vbus = sensed(reading.supply_v, config.vbus_v_per_lsb);
    let current = sensed(reading.current_a, config.current_a_per_lsb);
    Sample {
        count: reading.count,
        vbus_raw: vbus.map_or(Sample::VBUS_NOT_MEASURED, |raw| raw as u16),
        current_raw: current.map_or(Sample::CURRENT_NOT_SENSED, |raw| raw as i16),
    }
}
