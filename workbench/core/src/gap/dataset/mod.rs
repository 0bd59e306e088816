//! A log made ready for simulation: a grid of blocks, what is compared with what, and with which weight.
//!
//! Block k lasts from `time[k]` to `time[k + 1]`. Long logs are thinned: a block then holds several rows. Nothing is
//! lost on the input side, because the memoryless part of the input chain is evaluated on every row before it is
//! averaged; on the output side the sensor's window is applied to simulation and measurement alike.

mod agree;
mod applied_input;
mod coverage;
mod folds;
mod full_pass;
mod lockstep;
mod noise;
mod observation;
mod position;
mod preheat;
mod prepare;
mod probe;
mod rows;
mod run;
mod simulate;
mod start;
mod stretches;
mod weigh;

pub use agree::same;
pub use full_pass::FullPass;
pub use lockstep::{Compared, PACK, lockstep};
pub use noise::hf_noise;
pub use position::speeds;
pub use preheat::Preheat;
pub use prepare::prepare;
pub use probe::Probes;
pub use run::GridRun;
pub use simulate::{Simulation, Traces, pieces};

use crate::outcome::Searched;
use crate::system::log::Input;
use crate::system::model::Kind;
use crate::system::plant::physics::{Drive, Physics};

/// Longest step of the simulation in the search, as a part of the time constant. The shaft's own step is exact: what
/// bounds it is friction that begins or ends within it, and the current. Origin: decision 0301; half the steps of
/// 1/45, and no name changed.
pub const COARSE: f64 = 4.0 / 45.0;
/// Longest step of the simulation in the final fits, as a part of the time constant. Origin: design cases; at 1/45
/// the integrator's error beside an effect of a hundred times the noise was a third of the noise.
pub const FINE: f64 = 1.0 / 180.0;

/// Which rows serve for what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Fitted (first fold of the cross-validation).
    A,
    /// Fitted (second fold).
    B,
    /// Never fitted: read once, for the report.
    HoldOut,
    /// Not compared at all: spikes, gaps.
    Masked,
}

/// A log, or several, made ready.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// What the input is.
    pub input: Input,
    /// True on a linear axis.
    pub linear: bool,
    /// The runs.
    pub runs: Vec<GridRun>,
    /// Natural magnitudes of motor and log.
    pub scales: Scales,
    /// Fastest reading of log and hold-outs, but for one in a thousand.
    pub fastest: f64,
    /// Name of the compared column.
    pub signal: &'static str,
    /// Lag n of the moving-average noise of the compared signal, in samples; 0: white.
    pub noise_lag: usize,
    /// Standard deviation of the compared signal's noise.
    pub sigma: f64,
    /// The part of it that the declared encoder's steps make in a logged speed, row by row; 0 elsewhere.
    pub resolution: f64,
    /// Standard deviation of the current's noise, if the current is compared.
    pub sigma_current: Option<f64>,
    /// Two runs of the log with the same input, if there are; of a long log several pairs of their stretches.
    pub twins: Vec<(usize, usize)>,
    /// True if the position is compared, not the speed: the way from the start of a window.
    pub of_position: bool,
    /// True if the log holds the position, so that nobody has to integrate a measured speed.
    pub position_logged: bool,
    /// Things the reader must know.
    pub notes: Vec<String>,
    /// How much of a long log is in it; `None`: all.
    pub searched: Option<Searched>,
}

/// The natural magnitudes of a motor and its log, by which parameters are measured.
#[derive(Clone, Copy, Debug)]
pub struct Scales {
    /// Largest input.
    pub input: f64,
    /// Torque at that input and standstill.
    pub torque: f64,
    /// Largest measured speed; where nothing moves, the speed that the input would reach.
    pub speed: f64,
    /// Largest measured speed, 0 where nothing moves.
    pub motion: f64,
    /// Mechanical time constant, s.
    pub time: f64,
    /// Current at the largest input and standstill.
    pub current: f64,
    /// Winding resistance.
    pub resistance: f64,
    /// Inertia.
    pub inertia: f64,
    /// Speed that the input would reach without any effect: in the end, or within the log where little brakes.
    pub reachable: f64,
    /// Length of the longest run, s.
    pub duration: f64,
}

impl Scales {
    /// What one unit of a scale means.
    pub fn of(&self, scale: crate::system::effects::Scale) -> f64 {
        use crate::system::effects::Scale;
        match scale {
            Scale::One => 1.0,
            Scale::Input => self.input,
            Scale::Torque => self.torque,
            Scale::Speed => self.speed,
            Scale::Time => self.time,
            Scale::Current => self.current,
            Scale::Resistance => self.resistance,
            Scale::Viscous => self.torque / self.speed,
            Scale::Drag => self.torque / (self.speed * self.speed),
            Scale::Angle => self.speed * self.time,
            Scale::Frequency => 1.0 / self.time,
            Scale::PerPower => 1.0 / (self.current * self.current * self.resistance),
            Scale::Stiffness => self.inertia / (self.time * self.time),
            Scale::Capacity => self.time / self.resistance,
            Scale::TorquePerAngle(power) => self.torque / (self.speed * self.time).powi(power.into()),
        }
    }
}

impl Dataset {
    /// Unit of the compared signal.
    pub fn unit(&self) -> &'static str {
        match (self.of_position, self.linear) {
            (false, true) => "m/s",
            (false, false) => "rad/s",
            (true, true) => "m",
            (true, false) => "rad",
        }
    }

    /// Unit of a speed.
    pub fn speed_unit(&self) -> &'static str {
        if self.linear { "m/s" } else { "rad/s" }
    }

    /// Largest value of the compared signal, roughly.
    pub fn range(&self) -> f64 {
        if self.of_position { self.travel() } else { self.scales.speed }
    }

    /// The longest way between two positions of one run of the log, rad or m.
    pub fn travel(&self) -> f64 {
        run::travel(&self.runs)
    }

    /// Number of held-out samples of each record that has some, in the order of the records.
    pub fn held_out_samples(&self) -> Vec<usize> {
        let mut counts = std::collections::BTreeMap::new();
        for run in &self.runs {
            let held_out = run.speed.part.iter().filter(|part| **part == Part::HoldOut).count();
            if held_out > 0 {
                *counts.entry(run.log).or_insert(0) += held_out;
            }
        }
        counts.into_values().collect()
    }

    /// Number of compared samples of the main signal in the given parts.
    pub fn samples(&self, parts: &[Part]) -> usize {
        self.runs.iter().flat_map(|run| &run.speed.part).filter(|part| parts.contains(part)).count()
    }
}

/// The base plant of a kind when this input drives it.
pub fn driven_by(kind: &Kind, base: Physics, input: Input) -> Physics {
    match (kind, input) {
        (Kind::Inertia { .. }, _) | (_, Input::Voltage) => base,
        (_, Input::Current) => Physics { drive: Drive::Torque, force_gain: base.kt, ..base },
        (_, Input::Torque | Input::Force) => Physics { drive: Drive::Torque, force_gain: 1.0, ..base },
    }
}
