//! A record over time as the data of a hypothesis: its nuisances, its base, and the simulation of its runs.

use super::{Data, Hypothesis, NUISANCE_BOUND, Slot};
use crate::gap::dataset::{Dataset, FINE, GridRun, Scales, Simulation, Traces, driven_by};
use crate::system::effects::{Axis, Effect, Meaning, OF_SPEED_SENSOR, Parameter, Scale};
use crate::system::log::Input;
use crate::system::model::{DRIVE_GAIN, ELECTRICAL, KE, KT, Kind, Model, VISCOUS_V};
use crate::system::plant::physics::{Drive, Physics};
use crate::system::threads::of_each;
use servo::axis::Bridge;

/// How far a base parameter may move, in its tolerances, when the model is the best linear fit to the log and absorbs
/// what is missing. Origin: the gain of a linear fit to a joint that lifts a weight is eight times too small
/// (`xl330_pwm`); at half this bound friction was fitted to the gain that was missing.
const FITTED_BOUND: f64 = 6.0;
/// The tolerance of a base parameter of such a model: a factor of e^±0.5 is one standard deviation. Chosen by
/// judgement; not studied.
const FITTED_TOLERANCE: f64 = 0.5;
/// The same of the winding of such a model: it stands for L/R alone, which six of it move by a factor of 4.5, and not for a filter.
/// Chosen by judgement; not studied.
const FITTED_WINDING: f64 = 0.25;
/// A winding faster than this part of the mechanical time constant is no parameter that a log could tell. Held at its
/// nominal value, a slower one would pass for a measure: of a short delay, and with the current of the drive's gain.
/// Chosen by judgement; not studied.
const NOTICEABLE_WINDING: f64 = 0.003;

/// The fastest reading lies so many times the noise above what it would be without. Chosen by judgement; not studied.
const SCATTER: f64 = 4.0;

/// Step of the derivative with respect to the logarithm of a number of a motor, at most. What a log does not see (R,
/// J and b together) must not seem seen because a large step bends. Chosen by judgement; not studied.
const BASE_STEP: f64 = 2e-3;

impl Hypothesis<'_> {
    /// Simulates all runs with a plant; as [`Self::simulated_some`].
    pub fn simulated(&self, x: &[f64], plant: &Physics, each: impl FnMut(usize, &Traces, &[f64])) {
        self.simulated_some(x, plant, |_| true, each);
    }

    /// Simulates the chosen runs with a plant, which may be another than that of the numbers, and hands on each run's index,
    /// its traces and what its speed sensor would have shown.
    pub fn simulated_some(
        &self,
        x: &[f64],
        plant: &Physics,
        chosen: impl Fn(&GridRun) -> bool,
        mut each: impl FnMut(usize, &Traces, &[f64]),
    ) {
        let runs = self.dataset.runs.iter().enumerate().filter(|(_, run)| chosen(run));
        let runs: Vec<(usize, &GridRun)> = runs.collect();
        let simulated = of_each(&runs, |(index, run)| {
            let mut simulation = Simulation::default();
            simulation.speed(run, plant, self.start_speed(*index, x), FINE);
            simulation
        });
        for ((index, _), simulation) in runs.iter().zip(simulated) {
            each(*index, simulation.traces(), simulation.predicted());
        }
    }

    /// Start speed of a run.
    pub fn start_speed(&self, run: usize, x: &[f64]) -> f64 {
        let found = self.slots.iter().position(|slot| *slot == Slot::Start { run });
        let made = &self.dataset.runs[run];
        made.start_speed + found.map_or(0.0, |slot| x[slot] * made.start_sigma)
    }

    /// Whether an effect may join: offered on this axis, not there, not of a family that is there or known.
    pub fn admits(&self, effect: &'static Effect) -> bool {
        let drive = driven_by(&self.model.kind, self.model.base(), self.dataset.input).drive;
        let told = matches!(self.model.kind, Kind::FirstOrder { viscous_vs_per_rad, .. } if viscous_vs_per_rad > 0.0);
        let winding = matches!(self.model.kind, Kind::DcMotor { .. })
            || told && matches!(effect.axis, Axis::BackEmf | Axis::Current);
        let known = self.model.known.iter().map(|known| known.effect);
        let shows = !self.dataset.of_position || !OF_SPEED_SENSOR.contains(&effect);
        effect.fits(drive, winding, self.dataset.linear)
            && shows
            && !self.items.iter().any(|item| item.effect.same_family(effect))
            && !known.into_iter().any(|other| other == effect)
    }
}

/// Relative tolerance (1 σ) of a base parameter, wide where the model is the best linear fit to the log.
pub fn tolerance(model: &Model, key: &str) -> f64 {
    match key {
        _ if !model.fitted_to_log || model.tolerances.contains_key(key) => model.tolerance(key),
        ELECTRICAL => FITTED_WINDING,
        _ => FITTED_TOLERANCE,
    }
}

/// A number of the motor with this tolerance or more is not known: `truing start` gives 1. Half of it, chosen by
/// judgement.
const NOT_KNOWN: f64 = 0.5;

/// True if a number of the base is not known: torques follow from the model file no better.
pub fn is_open(model: &Model) -> bool {
    match model.kind {
        Kind::FirstOrder { .. } => model.fitted_to_log,
        Kind::DcMotor { .. } => ["R_ohm", KT, "J_kgm2"].iter().any(|key| tolerance(model, key) >= NOT_KNOWN),
        Kind::Inertia { .. } => false,
    }
}

impl Data for Dataset {
    fn scales(&self) -> &Scales {
        &self.scales
    }

    fn nuisances(&self, model: &Model) -> Vec<Slot> {
        let mut slots = base_slots(self, model);
        slots.extend(known_slots(model));
        let runs = self.runs.iter().enumerate();
        let moving = runs.filter(|(_, run)| run.start_sigma > 0.0);
        slots.extend(moving.map(|(run, _)| Slot::Start { run }));
        slots
    }

    fn reach(&self, model: &Model) -> f64 {
        if model.fitted_to_log { FITTED_BOUND } else { NUISANCE_BOUND }
    }

    /// Of a parameter a thousandth of its scale; of a frequency a phase of a hundredth of a turn over the log. Of a start a tenth and of
    /// a nuisance a fiftieth of its own ±. Steps that large are well above rounding and too small to bend. Judgement; not studied.
    fn step(&self, slot: &Slot, parameter: Option<&Parameter>) -> f64 {
        let scales = &self.scales;
        match (slot, parameter.map(|it| (it.scale, it.meaning))) {
            (Slot::Start { .. }, _) => 0.1,
            (Slot::Base { key: "R_ohm" | KT | KE | "J_kgm2", tolerance, .. }, _) => {
                (BASE_STEP / tolerance).min(0.02)
            }
            (_, None) => 0.02,
            (_, Some((Scale::Frequency, _))) => 0.01 * scales.time / scales.duration,
            (_, Some((_, Meaning::PeriodsPerTurn))) => 0.01 / (1.0 + scales.speed * scales.duration),
            (_, Some((Scale::Stiffness, _))) => 0.01,
            _ => 1e-3,
        }
    }

    fn least(&self, parameter: &Parameter) -> f64 {
        let read = (self.fastest - SCATTER * self.sigma) / self.scales.speed;
        let least = if parameter.meaning == Meaning::Ceiling { read } else { parameter.lower };
        least.clamp(parameter.lower, parameter.upper)
    }

    fn base(&self, model: &Model, kind: &Kind) -> Physics {
        let mut plant = driven_by(kind, model.base_of(kind), self.input);
        if !plant.supply_v.is_finite() {
            plant.supply_v = self.scales.input;
        }
        plant.unnamed = model.terms();
        plant
    }
}

/// Kt and Ke are one number unless the file states both; a winding too fast to be told keeps its time constant. Of a model that is a fit to
/// the log the gain of the drive says in which unit forces count.
fn base_slots(dataset: &Dataset, model: &Model) -> Vec<Slot> {
    let plant = driven_by(&model.kind, model.base(), dataset.input);
    let winding = plant.inductance / plant.resistance;
    let told = |key: &str| match (&model.kind, key) {
        (Kind::DcMotor { .. }, "L_h") | (_, ELECTRICAL) => {
            winding > NOTICEABLE_WINDING * plant.time_constant_s() && plant.drive == Drive::Voltage
        }
        (Kind::DcMotor { .. }, "R_ohm") => plant.drive == Drive::Voltage,
        (Kind::DcMotor { .. }, KE) => plant.drive == Drive::Voltage && model.constant.is_none(),
        (Kind::DcMotor { .. }, KT) => dataset.input != Input::Torque,
        (Kind::Inertia { .. }, DRIVE_GAIN) => {
            !model.fitted_to_log || model.tolerances.contains_key(DRIVE_GAIN)
        }
        (_, VISCOUS_V) => dataset.runs.iter().any(|run| run.bridge.contains(&Bridge::Open)),
        _ => true,
    };
    let twin = |key: &str| match key {
        KT if model.constant.is_some() => Some((KE, plant.ke)),
        "R_ohm" if !told("L_h") => Some(("L_h", plant.inductance)),
        _ => None,
    };
    let parameters = model.parameters().into_iter().filter(|(key, value)| *value > 0.0 && told(key));
    let slot = |(key, nominal)| {
        let tolerance = tolerance(model, key);
        (tolerance > 0.0).then_some(Slot::Base { key, nominal, tolerance, twin: twin(key) })
    };
    parameters.filter_map(slot).collect()
}

/// Known effects move by their standard deviation, or by the default tolerance where the file gives none; how the log begins is free.
fn known_slots(model: &Model) -> Vec<Slot> {
    let mut slots = Vec::new();
    for (known, it) in model.known.iter().enumerate() {
        for (parameter, spec) in it.effect.parameters.iter().enumerate() {
            let value = it.values[parameter];
            let fixed =
                spec.meaning == Meaning::PeriodsPerTurn || (value == 0.0 && it.stds[parameter].is_none());
            let free = spec.meaning == Meaning::AtStart;
            let default = if spec.meaning == Meaning::Phase {
                model.tolerance("default")
            } else {
                model.tolerance("default") * value.abs()
            };
            let std = if free { spec.upper } else { it.stds[parameter].unwrap_or(default) };
            if free || !fixed && std > 0.0 {
                slots.push(Slot::Known { known, parameter, std });
            }
        }
    }
    slots
}
