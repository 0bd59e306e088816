//! A hypothesis: the base model with a set of effects, as a vector of numbers that a fit may move.
//!
//! Every base parameter moves inside its tolerance in every fit (a prior of one tolerance, bounds of two): a model
//! file that is off by its tolerance must not make an effect, and must not hide one.

use crate::gap::dataset::{Bench, BenchRun, Scales, Simulation, Traces, driven_by};
use crate::gap::fit::FINE;
use crate::system::effects::{Effect, Meaning, Parameter, Scale};
use crate::system::log::Input;
use crate::system::model::{Kind, Model};
use crate::system::plant::physics::{Drive, Physics};

/// How far a nuisance may move, in its standard deviations. A Gaussian prior alone does not hold against a long log.
const NUISANCE_BOUND: f64 = 2.0;
/// The same, when the model is the best linear fit to the log and absorbs what is missing.
const FITTED_BOUND: f64 = 3.0;
/// Its tolerance then: a factor of e^±0.5 is one standard deviation.
const FITTED_TOLERANCE: f64 = 0.5;
/// A winding faster than this part of the mechanical time constant is no parameter that a log could tell. Held at its
/// nominal value, a slower one would pass for a measure: of a short delay, and with the current of the drive's gain.
const NOTICEABLE_WINDING: f64 = 0.003;

/// What a hypothesis is compared with: a record over time or a table of settled speeds.
pub trait Data: Sync {
    /// The natural magnitudes of motor and log.
    fn scales(&self) -> &Scales;

    /// The numbers that every fit may move besides the effects' parameters.
    fn nuisances(&self, model: &Model) -> Vec<Slot>;

    /// How far a base parameter may move, in its tolerances.
    fn reach(&self, model: &Model) -> f64;

    /// Step of the numeric derivative of a number, which may be a parameter of an effect.
    fn step(&self, slot: &Slot, parameter: Option<&Parameter>) -> f64;

    /// The plant of base parameters, without any effect.
    fn base(&self, model: &Model, kind: &Kind) -> Physics;

    /// Whether an effect that the model already contains shows in such data.
    fn shows(&self, known: &Effect) -> bool;

    /// Puts right what several effects together make impossible.
    fn tidy(&self, plant: &mut Physics);
}

/// Which parameters of an effect a fit moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Freedom {
    /// Those without a default: the simplest form.
    Plain,
    /// All, a softness too.
    Full,
    /// Those that are not pinned to a value here.
    Pinned(&'static [Option<f64>]),
}

/// One effect of a hypothesis.
#[derive(Clone, Copy, Debug)]
pub struct Item {
    /// The effect.
    pub effect: &'static Effect,
    /// Which of its parameters move.
    pub freedom: Freedom,
}

impl Item {
    /// An effect whose optional parameters keep their defaults.
    pub fn plain(effect: &'static Effect) -> Self {
        let freedom = Freedom::Plain;
        Self { effect, freedom }
    }

    /// An effect whose parameters all move.
    pub fn full(effect: &'static Effect) -> Self {
        let freedom = Freedom::Full;
        Self { effect, freedom }
    }

    /// True if all its parameters move.
    pub fn is_full(&self) -> bool {
        self.freedom == Freedom::Full
    }

    /// The value of a parameter that does not move.
    pub fn pinned(&self, parameter: usize) -> Option<f64> {
        match self.freedom {
            Freedom::Plain => self.effect.parameters[parameter].default,
            Freedom::Full => None,
            Freedom::Pinned(values) => values[parameter],
        }
    }

    /// Indices of the parameters that move.
    pub fn free(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.effect.parameters.len()).filter(|k| self.pinned(*k).is_none())
    }

    /// Number of the parameters that move.
    pub fn size(&self) -> usize {
        self.free().count()
    }

    /// True if it has optional parameters that do not move.
    pub fn can_grow(&self) -> bool {
        let mut parameters = self.effect.parameters.iter();
        !self.is_full() && parameters.any(|parameter| parameter.default.is_some())
    }
}

/// What one number of the vector stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)] // The variants say what their fields are.
pub enum Slot {
    /// Parameter `parameter` of item `item`, in units of its scale.
    Effect { item: usize, parameter: usize },
    /// Logarithm of a base parameter over its nominal value, in tolerances.
    Base {
        key: &'static str,
        nominal: f64,
        tolerance: f64,
        /// Key and nominal value of a parameter that moves by the same ratio.
        twin: Option<(&'static str, f64)>,
    },
    /// Shift of a known effect's parameter, in standard deviations.
    Known { known: usize, parameter: usize, std: f64 },
    /// Shift of a run's start speed, in standard deviations.
    Start { run: usize },
}

impl Slot {
    /// True if the number has a Gaussian prior N(0, 1).
    pub fn has_prior(&self) -> bool {
        !matches!(self, Self::Effect { .. })
    }
}

/// The base model with effects, compared with a record over time unless said otherwise.
#[derive(Debug)]
pub struct Hypothesis<'a, D = Bench> {
    /// What is compared.
    pub bench: &'a D,
    /// The model as given.
    pub model: &'a Model,
    /// The effects in the order of naming.
    pub items: Vec<Item>,
    /// What the numbers stand for: the effects' parameters first.
    pub slots: Vec<Slot>,
}

impl<D> Clone for Hypothesis<'_, D> {
    fn clone(&self) -> Self {
        Self { bench: self.bench, model: self.model, items: self.items.clone(), slots: self.slots.clone() }
    }
}

impl<'a, D: Data> Hypothesis<'a, D> {
    /// The base model with these effects.
    pub fn new(bench: &'a D, model: &'a Model, items: Vec<Item>) -> Self {
        let own = |(item, it): (usize, &Item)| {
            let slot = |parameter| Slot::Effect { item, parameter };
            it.free().map(slot).collect::<Vec<Slot>>()
        };
        let mut slots: Vec<Slot> = items.iter().enumerate().flat_map(own).collect();
        slots.extend(bench.nuisances(model));
        Self { bench, model, items, slots }
    }

    /// The same data and model with other effects.
    pub fn with(&self, items: Vec<Item>) -> Self {
        Self::new(self.bench, self.model, items)
    }

    /// Number of effect parameters: they come first.
    pub fn effect_slots(&self) -> usize {
        self.slots.iter().filter(|slot| matches!(slot, Slot::Effect { .. })).count()
    }

    /// The numbers that have a prior, in its standard deviations.
    pub fn priors(&self, x: &[f64]) -> impl Iterator<Item = f64> {
        let slots = self.slots.iter().zip(x);
        slots.filter(|(slot, _)| slot.has_prior()).map(|(_, z)| *z)
    }

    /// Lower and upper bound of a number.
    pub fn bounds(&self, slot: usize) -> (f64, f64) {
        match self.slots[slot] {
            Slot::Effect { item, parameter } => {
                let parameter = &self.items[item].effect.parameters[parameter];
                (parameter.lower, parameter.upper)
            }
            Slot::Base { .. } => {
                let reach = self.bench.reach(self.model);
                (-reach, reach)
            }
            Slot::Known { .. } => (-NUISANCE_BOUND, NUISANCE_BOUND),
            Slot::Start { .. } => (-4.0, 4.0),
        }
    }

    /// Step of the numeric derivative of a number.
    pub fn step(&self, slot: usize) -> f64 {
        let parameter = match self.slots[slot] {
            Slot::Effect { item, parameter } => Some(&self.items[item].effect.parameters[parameter]),
            _ => None,
        };
        self.bench.step(&self.slots[slot], parameter)
    }

    /// The place of a parameter of an effect among the numbers, if it moves.
    pub fn slot(&self, item: usize, parameter: usize) -> Option<usize> {
        let own = Slot::Effect { item, parameter };
        self.slots.iter().position(|slot| *slot == own)
    }

    /// A parameter of an effect in its own unit.
    pub fn value(&self, item: usize, parameter: usize, x: &[f64]) -> f64 {
        let spec = &self.items[item].effect.parameters[parameter];
        match self.slot(item, parameter) {
            Some(slot) => x[slot] * self.bench.scales().of(spec.scale),
            None => self.items[item].pinned(parameter).unwrap_or(0.0),
        }
    }

    /// All parameters of an effect in their own units.
    pub fn values(&self, item: usize, x: &[f64]) -> Vec<f64> {
        let parameters = 0..self.items[item].effect.parameters.len();
        parameters.map(|parameter| self.value(item, parameter, x)).collect()
    }

    /// The plant that the numbers describe.
    pub fn plant(&self, x: &[f64]) -> Physics {
        let mut plant = self.base(x);
        for (index, known) in self.model.known.iter().enumerate() {
            if !self.bench.shows(known.effect) {
                continue;
            }
            let mut values = known.values.clone();
            for (slot, z) in self.slots.iter().zip(x) {
                match slot {
                    Slot::Known { known, parameter, std } if *known == index => values[*parameter] += std * z,
                    _ => {}
                }
            }
            (known.effect.apply)(&values, &mut plant);
        }
        for (item, it) in self.items.iter().enumerate() {
            (it.effect.apply)(&self.values(item, x), &mut plant);
        }
        self.bench.tidy(&mut plant);
        plant
    }

    /// The base with its moved parameters, without known effects.
    fn base(&self, x: &[f64]) -> Physics {
        let mut kind = self.model.kind;
        for (slot, z) in self.slots.iter().zip(x) {
            if let Slot::Base { key, nominal, tolerance, twin } = slot {
                let ratio = (tolerance * z).exp();
                for (key, nominal) in std::iter::once((*key, *nominal)).chain(*twin) {
                    kind.set(key, nominal * ratio);
                }
            }
        }
        self.bench.base(self.model, &kind)
    }

    /// Carries the numbers of another hypothesis over to this one; what it lacks gets `default`.
    pub fn carried(&self, from: &Self, x: &[f64], default: &dyn Fn(&Slot) -> f64) -> Vec<f64> {
        let value = |slot: &Slot| match slot {
            Slot::Effect { item, parameter } => {
                let effect = self.items[*item].effect;
                let twin = from.items.iter().position(|it| it.effect == effect);
                twin.and_then(|item| from.slot(item, *parameter)).map(|k| x[k])
            }
            other => from.slots.iter().position(|s| s == other).map(|k| x[k]),
        };
        self.slots.iter().map(|slot| value(slot).unwrap_or_else(|| default(slot))).collect()
    }

    /// The hypothesis with some of its effects, and the numbers that it keeps.
    pub fn only(&self, x: &[f64], keep: impl Fn(usize) -> bool) -> (Self, Vec<f64>) {
        let kept = (0..self.items.len()).filter(|k| keep(*k));
        let some = self.with(kept.map(|k| self.items[k]).collect());
        let x = some.carried(self, x, &|_| 0.0);
        (some, x)
    }

    /// Names of the effects.
    pub fn names(&self) -> Vec<String> {
        self.items.iter().map(|item| item.effect.name.to_owned()).collect()
    }
}

impl Hypothesis<'_> {
    /// Simulates the chosen runs with a plant, which may be another than that of the numbers, and hands on each run's index,
    /// its traces and what its speed sensor would have shown.
    pub fn simulated(
        &self,
        x: &[f64],
        plant: &Physics,
        chosen: impl Fn(&BenchRun) -> bool,
        mut each: impl FnMut(usize, &Traces, &[f64]),
    ) {
        let mut simulation = Simulation::default();
        for (index, run) in self.bench.runs.iter().enumerate().filter(|(_, run)| chosen(run)) {
            let (traces, predicted) = simulation.speed(run, plant, self.start_speed(index, x), FINE);
            each(index, traces, predicted);
        }
    }

    /// Start speed of a run.
    pub fn start_speed(&self, run: usize, x: &[f64]) -> f64 {
        let found = self.slots.iter().position(|slot| *slot == Slot::Start { run });
        let made = &self.bench.runs[run];
        made.start_speed + found.map_or(0.0, |slot| x[slot] * made.start_sigma)
    }

    /// Whether an effect may join: offered on this axis, not there, not of a family that is there or known.
    pub fn admits(&self, effect: &'static Effect) -> bool {
        let drive = driven_by(&self.model.kind, self.model.base(), self.bench.input).drive;
        let winding = matches!(self.model.kind, Kind::DcMotor { .. });
        let known = self.model.known.iter().map(|known| known.effect);
        effect.fits(drive, winding, self.bench.linear)
            && !self.items.iter().any(|item| item.effect.same_family(effect))
            && !known.into_iter().any(|other| other == effect)
    }
}

/// Relative tolerance (1 σ) of a base parameter, wide where the model is the best linear fit to the log.
pub fn tolerance(model: &Model, key: &str) -> f64 {
    if model.fitted_to_log && !model.tolerances.contains_key(key) {
        FITTED_TOLERANCE
    } else {
        model.tolerance(key)
    }
}

impl Data for Bench {
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

    /// Of a parameter a thousandth of its scale; of a frequency a phase of a hundredth of a turn over the log.
    fn step(&self, slot: &Slot, parameter: Option<&Parameter>) -> f64 {
        let scales = &self.scales;
        match (slot, parameter.map(|it| (it.scale, it.meaning))) {
            (Slot::Start { .. }, _) => 0.1,
            (_, None) => 0.02,
            (_, Some((Scale::Frequency, _))) => 0.01 * scales.time / scales.duration,
            (_, Some((_, Meaning::PeriodsPerTurn))) => 0.01 / (1.0 + scales.speed * scales.duration),
            (_, Some((Scale::Stiffness, _))) => 0.01,
            _ => 1e-3,
        }
    }

    fn base(&self, model: &Model, kind: &Kind) -> Physics {
        let mut plant = driven_by(kind, model.base_of(kind), self.input);
        if !plant.supply_v.is_finite() {
            plant.supply_v = self.scales.input;
        }
        plant
    }

    fn shows(&self, _: &Effect) -> bool {
        true
    }

    fn tidy(&self, _: &mut Physics) {}
}

fn base_slots(bench: &Bench, model: &Model) -> Vec<Slot> {
    let plant = driven_by(&model.kind, model.base(), bench.input);
    let winding = plant.inductance / plant.resistance;
    let told = |key: &str| match (&model.kind, key) {
        (Kind::DcMotor { .. }, "L_h") => {
            winding > NOTICEABLE_WINDING * plant.time_constant_s() && plant.drive == Drive::Voltage
        }
        (Kind::DcMotor { .. }, "R_ohm" | "Ke_vs_per_rad") => plant.drive == Drive::Voltage,
        (Kind::DcMotor { .. }, "Kt_nm_per_a") => bench.input != Input::Torque,
        _ => true,
    };
    let parameters = model.parameters().into_iter().filter(|(key, value)| *value > 0.0 && told(key));
    let slot = |(key, nominal)| {
        let tolerance = tolerance(model, key);
        (tolerance > 0.0).then_some(Slot::Base { key, nominal, tolerance, twin: None })
    };
    parameters.filter_map(slot).collect()
}

/// Known effects move by their standard deviation, or by the default tolerance where the file gives none.
fn known_slots(model: &Model) -> Vec<Slot> {
    let mut slots = Vec::new();
    for (known, it) in model.known.iter().enumerate() {
        for (parameter, spec) in it.effect.parameters.iter().enumerate() {
            let value = it.values[parameter];
            let fixed =
                spec.meaning == Meaning::PeriodsPerTurn || (value == 0.0 && it.stds[parameter].is_none());
            let default = if spec.meaning == Meaning::Phase {
                model.default_tolerance
            } else {
                model.default_tolerance * value.abs()
            };
            let std = it.stds[parameter].unwrap_or(default);
            if !fixed && std > 0.0 {
                slots.push(Slot::Known { known, parameter, std });
            }
        }
    }
    slots
}
