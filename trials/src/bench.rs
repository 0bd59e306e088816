//! A board made of numbers: the truth's motor, its sensors and a PWM that acts one period late, in lock-step with the
//! library.

use crate::families::Plant;
use servo::axis::Command;
use servo::axis::{Axis, Bridge, Output, Refusal, Sample, State};
use std::collections::VecDeque;
use truing::synthetic::reference_plant::{Converter, Encoder, Reading, Simulator};

/// Error of the simulation in one step, relative to full scale: far below a count and a converter step.
const TOLERANCE: f64 = 1e-6;

/// Motor, sensors and PWM. Feed it commands, read samples.
#[derive(Clone, Debug)]
pub struct Board {
    simulator: Simulator,
    encoder: Encoder,
    supply: Option<Converter>,
    current: Option<Converter>,
    vbus_v_per_lsb: f64,
    current_a_per_lsb: f64,
    full_scale: f64,
    tick_s: f64,
    line: VecDeque<(Bridge, i16)>,
    supply_share: f64,
    last: Reading,
}

impl Board {
    /// A board that was just switched on.
    pub fn new(plant: &Plant) -> Self {
        let simulator = Simulator::new(plant.motor.clone(), TOLERANCE, plant.seed);
        let (config, sensing) = (&plant.config, &plant.sensing);
        let supply_noise = sensing.vbus_noise * f64::from(config.supply_nominal_v);
        let stall = plant.motor.drive.supply_v / plant.motor.resistance_ohm;
        let last = Reading { theta: 0.0, omega: 0.0, current: 0.0, supply: simulator.supply() };
        let converter = |rms, delay, salt: u64| Converter::new(rms, 0.0, delay, plant.seed ^ salt);
        Self {
            encoder: Encoder::new(config.counts_per_rev, sensing.phase_error, plant.seed ^ 1)
                .losing(sensing.missing),
            supply: sensing.vbus.then(|| converter(supply_noise, sensing.vbus_delay, 2)),
            current: sensing.current.then(|| converter(sensing.current_noise * stall, 0, 3)),
            vbus_v_per_lsb: f64::from(config.vbus_v_per_lsb),
            current_a_per_lsb: f64::from(config.current_a_per_lsb),
            full_scale: f64::from(config.pwm_full_scale),
            tick_s: 1.0 / f64::from(config.tick_hz),
            line: VecDeque::from(vec![(Bridge::Open, 0); usize::from(config.pwm_delay_ticks)]),
            supply_share: 1.0,
            simulator,
            last,
        }
    }

    /// The supply is this share of the plant's from now on.
    pub fn supply_falls_to(&mut self, share: f64) {
        self.supply_share = share;
    }

    /// What the firmware reads now. Once a tick.
    pub fn sample(&mut self) -> Sample {
        let count = self.encoder.count(self.last.theta) as i32;
        let vbus_raw = match &mut self.supply {
            Some(converter) => {
                (converter.read(self.last.supply * self.supply_share) / self.vbus_v_per_lsb).round() as u16
            }
            None => Sample::VBUS_NOT_MEASURED,
        };
        let current_raw = match &mut self.current {
            Some(converter) => (converter.read(self.last.current) / self.current_a_per_lsb).round() as i16,
            None => Sample::CURRENT_NOT_SENSED,
        };
        Sample { count, vbus_raw, current_raw }
    }

    /// Takes the command of this tick and lets one tick pass; the command acts `pwm_delay_ticks` later.
    pub fn pass(&mut self, bridge: Bridge, duty: i16) -> Reading {
        self.line.push_back((bridge, duty));
        let (bridge, duty) = self.line.pop_front().unwrap_or((bridge, duty));
        let share = self.supply_share * f64::from(duty) / self.full_scale;
        self.last = self.simulator.step(share, bridge, self.tick_s);
        self.last
    }

    /// The state of the world.
    pub fn reading(&self) -> Reading {
        self.last
    }

    /// Comes out of a dead stop with this winding current.
    pub fn released(&mut self, current: f64) {
        self.simulator.released(current);
        (self.last.omega, self.last.current) = (0.0, current);
    }

    /// The simulator behind the board.
    pub fn simulator(&self) -> &Simulator {
        &self.simulator
    }
}

/// An axis on its board.
#[derive(Clone, Debug)]
pub struct Bench {
    /// The library.
    pub axis: Axis,
    /// Its state.
    pub state: State,
    /// The world.
    pub board: Board,
}

impl Bench {
    /// The library set up for this plant.
    ///
    /// # Panics
    /// If the library refuses the plant's configuration, with its reason.
    pub fn new(plant: &Plant) -> Self {
        let axis = Axis::new(&plant.config).unwrap_or_else(|error| panic!("{error:?}: {:?}", plant.config));
        let state = axis.start();
        Self { axis, state, board: Board::new(plant) }
    }

    /// Asks the library for something.
    ///
    /// # Errors
    /// Why it refuses.
    pub fn ask(&mut self, command: Command) -> Result<(), Refusal> {
        self.axis.command(&mut self.state, &command)
    }

    /// One tick of both.
    pub fn tick(&mut self) -> Output {
        let sample = self.board.sample();
        let output = self.axis.step(&mut self.state, sample);
        self.board.pass(output.bridge, output.duty);
        output
    }

    /// Runs for so many seconds and shows each tick's output and the world after it.
    pub fn run(&mut self, seconds: f64, mut watch: impl FnMut(&Output, &Reading)) {
        let ticks = (seconds / self.board.tick_s).round() as u64;
        for _ in 0..ticks {
            let output = self.tick();
            watch(&output, &self.board.last);
        }
    }
}
