//! A joint on the bench: the library's axis and a true motor in lock-step, tick by tick.

use servo::axis::{Axis, Bridge, Output, Sample, State};
use servo::config::{Config, ConfigError};
use servo::control::Tuning;
use servo::identify::estimate::{
    Estimate, Estimates, GAIN_FRAC, Mechanism, Standing, TIME_FRAC, VOLTAGE_FRAC,
};
use servo::protocol::Command;
use std::f64::consts::TAU;
use truing::truth::{Converter, Encoder, Motor, Simulator};

/// Everything about one joint that does not change while it runs.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The true motor.
    pub motor: Motor,
    /// What the firmware is told.
    pub config: Config,
    /// Phase error of the encoder, counts.
    pub encoder_error: f64,
    /// Rms noise of the supply measurement, V; infinite: not measured.
    pub supply_noise_v: f64,
    /// Is the winding current sensed?
    pub current_sensed: bool,
    /// Rules every random signal.
    pub seed: u64,
}

/// A running joint.
pub struct Joint {
    /// The firmware's axis.
    pub axis: Axis,
    /// Its state.
    pub state: State,
    /// What it did last.
    pub output: Output,
    /// True angle, rad.
    pub theta: f64,
    /// True speed, rad/s.
    pub omega: f64,
    simulator: Simulator,
    encoder: Encoder,
    supply: Option<Converter>,
    pipeline: Vec<(Bridge, i16)>,
    current: Option<f64>,
    config: Config,
}

impl Joint {
    /// Switches the joint on.
    pub fn new(plan: &Plan, tuning: Tuning) -> Result<Self, ConfigError> {
        let axis = Axis::with_tuning(&plan.config, tuning)?;
        let lsb = f64::from(plan.config.vbus_v_per_lsb);
        let measured = plan.supply_noise_v.is_finite();
        Ok(Self {
            state: axis.start(),
            axis,
            output: Output::default(),
            theta: 0.0,
            omega: 0.0,
            simulator: Simulator::new(plan.motor.clone(), 1e-6, plan.seed),
            encoder: Encoder::new(plan.config.counts_per_rev, plan.encoder_error, plan.seed ^ 0xe4c0),
            supply: measured.then(|| Converter::new(plan.supply_noise_v, lsb, 0, plan.seed ^ 0x5b)),
            pipeline: vec![(Bridge::Open, 0); usize::from(plan.config.pwm_delay_ticks)],
            current: plan.current_sensed.then_some(0.0),
            config: plan.config,
        })
    }

    /// Length of a tick, s.
    pub fn tick_s(&self) -> f64 {
        1.0 / f64::from(self.config.tick_hz)
    }

    /// Counts per radian.
    pub fn counts_per_rad(&self) -> f64 {
        f64::from(self.config.counts_per_rev) / TAU
    }

    /// One control tick: sample, compute, and let the motor move under the command that is in force.
    pub fn tick(&mut self) -> Output {
        let sample = self.sample();
        self.output = self.axis.step(&mut self.state, sample);
        self.pipeline.push((self.output.bridge, self.output.duty));
        let (bridge, duty) = self.pipeline.remove(0);
        let share = f64::from(duty) / f64::from(self.config.pwm_full_scale);
        let reading = self.simulator.step(share, bridge, self.tick_s());
        (self.theta, self.omega) = (reading.theta, reading.omega);
        self.current = self.current.map(|_| reading.current);
        self.output
    }

    fn sample(&mut self) -> Sample {
        let volts = self.simulator.supply();
        let lsb = f64::from(self.config.vbus_v_per_lsb);
        let amperes = f64::from(self.config.current_a_per_lsb);
        Sample {
            count: self.encoder.count(self.theta) as i32,
            vbus_raw: self
                .supply
                .as_mut()
                .map_or(Sample::VBUS_NOT_MEASURED, |converter| {
                    (converter.read(volts) / lsb).round() as u16
                }),
            current_raw: self
                .current
                .map_or(Sample::CURRENT_NOT_SENSED, |i| (i / amperes).round() as i16),
        }
    }

    /// Ticks for a time, s.
    pub fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds / self.tick_s()).round() as u64 {
            self.tick();
        }
    }

    /// Gives a command that must be accepted.
    pub fn must(&mut self, command: Command) {
        if let Err(refusal) = self.axis.command(&mut self.state, &command) {
            panic!("{command:?} was refused: {refusal:?}");
        }
    }

    /// Reference of the last tick, counts from power-up.
    pub fn reference(&self) -> f64 {
        f64::from(self.output.record.reference_q8) / 256.0
    }

    /// True position, counts from power-up.
    pub fn position(&self) -> f64 {
        self.theta * self.counts_per_rad()
    }
}

/// Estimates as a commissioning without error would bring them.
pub fn exact(
    config: &Config,
    dead_zone: [f64; 2],
    saturation: [Option<f64>; 2],
    gain: f64,
    tau: f64,
    mechanism: Mechanism,
) -> Estimates {
    let trusted = |value: f64| Estimate {
        value: value.round() as i32,
        u95: 0,
        standing: Standing::Trusted,
    };
    let volt = f64::from(1u32 << VOLTAGE_FRAC) / f64::from(config.supply_nominal_v);
    let relative = gain * f64::from(config.supply_nominal_v) / f64::from(config.rated_speed_rad_s);
    Estimates {
        dead_zone: dead_zone.map(|v| trusted(v * volt)),
        saturation: saturation.map(|level| level.map_or(Estimate::default(), |v| trusted(v * volt))),
        gain: trusted(relative * f64::from(1u32 << GAIN_FRAC)),
        time_constant: trusted(tau * f64::from(config.tick_hz) * f64::from(1u32 << TIME_FRAC)),
        mechanism,
    }
}
