//! A hypothesis: the base model with a set of effects, as a vector of numbers that a fit may move.
//!
//! Every base parameter moves inside its tolerance in every fit (a prior of one tolerance, bounds of two): a model
//! file that is off by its tolerance must not make an effect, and must not hide one.

use crate::gap::dataset::{Bench, driven_by};
use crate::system::effects::{Effect, Meaning, Parameter, Scale};
use crate::system::model::{Kind, Model};
use crate::system::plant::physics::Physics;

/// How far a nuisance may move, in its standard deviations. A Gaussian prior alone does not hold against a long log.
const NUISANCE_BOUND: f64 = 2.0;
/// The same, when the model is the best linear fit to the log and absorbs what is missing.
const FITTED_BOUND: f64 = 3.0;
/// Its tolerance then: a factor of e^±0.5 is one standard deviation.
const FITTED_TOLERANCE: f64 = 0.5;
/// A winding faster than this part of the mechanical time constant is no parameter that a log could tell. Held at its
/// nominal value, a slower one would pass for a measure: of a short delay, and with the current of the drive's gain.
const NOTICEABLE_WINDING: f64 = 0.003;

/// One effect of a hypothesis.
#[derive(Clone, Copy, Debug)]
pub struct Item {
    /// The effect.
    pub effect: &'static Effect,
    /// Whether its optional parameters (a softness) move too.
    pub full: bool,
}

impl Item {
    /// Indices of the parameters that move.
    pub fn free(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.effect.parameters.len())
            .filter(|k| self.full || self.effect.parameters[*k].default.is_none())
    }

    /// True if it has optional parameters that do not move.
    pub fn can_grow(&self) -> bool {
        !self.full
            && self
                .effect
                .parameters
                .iter()
                .any(|parameter| parameter.default.is_some())
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
    },
    /// Shift of a known effect's parameter, in standard deviations.
    Known {
        known: usize,
        parameter: usize,
        std: f64,
    },
    /// Shift of a run's start speed, in standard deviations.
    Start { run: usize },
}

impl Slot {
    /// True if the number has a Gaussian prior N(0, 1).
    pub fn has_prior(&self) -> bool {
        !matches!(self, Self::Effect { .. })
    }
}

/// The base model with effects.
#[derive(Clone, Debug)]
pub struct Hypothesis<'a> {
    /// What is compared.
    pub bench: &'a Bench,
    /// The model as given.
    pub model: &'a Model,
    /// The effects in the order of naming.
    pub items: Vec<Item>,
    /// What the numbers stand for: the effects' parameters first.
    pub slots: Vec<Slot>,
}

impl<'a> Hypothesis<'a> {
    /// The base model with these effects.
    pub fn new(bench: &'a Bench, model: &'a Model, items: Vec<Item>) -> Self {
        let mut slots = Vec::new();
        for (item, it) in items.iter().enumerate() {
            slots.extend(it.free().map(|parameter| Slot::Effect { item, parameter }));
        }
        slots.extend(base_slots(bench, model));
        slots.extend(known_slots(model));
        let moving = bench
            .runs
            .iter()
            .enumerate()
            .filter(|(_, run)| run.start_sigma > 0.0);
        slots.extend(moving.map(|(run, _)| Slot::Start { run }));
        Self {
            bench,
            model,
            items,
            slots,
        }
    }

    /// Number of effect parameters: they come first.
    pub fn effect_slots(&self) -> usize {
        self.slots
            .iter()
            .filter(|slot| matches!(slot, Slot::Effect { .. }))
            .count()
    }

    /// Lower and upper bound of a number.
    pub fn bounds(&self, slot: usize) -> (f64, f64) {
        match self.slots[slot] {
            Slot::Effect { item, parameter } => {
                let parameter = &self.items[item].effect.parameters[parameter];
                (parameter.lower, parameter.upper)
            }
            Slot::Base { .. } if self.model.fitted_to_log => (-FITTED_BOUND, FITTED_BOUND),
            Slot::Base { .. } | Slot::Known { .. } => (-NUISANCE_BOUND, NUISANCE_BOUND),
            Slot::Start { .. } => (-4.0, 4.0),
        }
    }

    /// Step of the numeric derivative of a number.
    pub fn step(&self, slot: usize) -> f64 {
        match self.slots[slot] {
            Slot::Effect { item, parameter } => {
                self.effect_step(&self.items[item].effect.parameters[parameter])
            }
            Slot::Base { .. } | Slot::Known { .. } => 0.02,
            Slot::Start { .. } => 0.1,
        }
    }

    /// A thousandth of the scale; for frequencies a phase of a hundredth of a turn over the log.
    fn effect_step(&self, parameter: &Parameter) -> f64 {
        let scales = &self.bench.scales;
        match (parameter.scale, parameter.meaning) {
            (Scale::Frequency, _) => 0.01 * scales.time / scales.duration,
            (_, Meaning::PeriodsPerTurn) => 0.01 / (1.0 + scales.speed * scales.duration),
            (Scale::Stiffness, _) => 0.01,
            _ => 1e-3,
        }
    }

    /// A parameter of an effect in its own unit.
    pub fn value(&self, item: usize, parameter: usize, x: &[f64]) -> f64 {
        let slot = self
            .slots
            .iter()
            .position(|slot| *slot == Slot::Effect { item, parameter });
        let spec = &self.items[item].effect.parameters[parameter];
        match slot {
            Some(slot) => x[slot] * self.bench.scales.of(spec.scale),
            None => spec.default.unwrap_or(0.0),
        }
    }

    /// The plant that the numbers describe.
    pub fn plant(&self, x: &[f64]) -> Physics {
        let mut plant = self.base(x);
        for (index, known) in self.model.known.iter().enumerate() {
            let mut values = known.values.clone();
            for (slot, z) in self.slots.iter().zip(x) {
                match slot {
                    Slot::Known {
                        known,
                        parameter,
                        std,
                    } if *known == index => values[*parameter] += std * z,
                    _ => {}
                }
            }
            (known.effect.apply)(&values, &mut plant);
        }
        for (item, it) in self.items.iter().enumerate() {
            let parameters = 0..it.effect.parameters.len();
            let values: Vec<f64> = parameters
                .map(|parameter| self.value(item, parameter, x))
                .collect();
            (it.effect.apply)(&values, &mut plant);
        }
        plant
    }

    /// The base with its moved parameters, without known effects.
    fn base(&self, x: &[f64]) -> Physics {
        let mut kind = self.model.kind;
        for (slot, z) in self.slots.iter().zip(x) {
            if let Slot::Base {
                key,
                nominal,
                tolerance,
            } = slot
            {
                kind.set(key, nominal * (tolerance * z).exp());
            }
        }
        let mut plant = driven_by(&kind, self.model.base_of(&kind), self.bench.input);
        if !plant.supply_v.is_finite() {
            plant.supply_v = self.bench.scales.input;
        }
        plant
    }

    /// Start speed of a run.
    pub fn start_speed(&self, run: usize, x: &[f64]) -> f64 {
        let found = self.slots.iter().position(|slot| *slot == Slot::Start { run });
        let made = &self.bench.runs[run];
        made.start_speed + found.map_or(0.0, |slot| x[slot] * made.start_sigma)
    }

    /// Carries the numbers of another hypothesis over to this one; what it lacks gets `default`.
    pub fn carried(&self, from: &Hypothesis, x: &[f64], default: &dyn Fn(&Slot) -> f64) -> Vec<f64> {
        let value = |slot: &Slot| match slot {
            Slot::Effect { item, parameter } => {
                let effect = self.items[*item].effect;
                let twin = from.items.iter().position(|it| it.effect == effect);
                twin.and_then(|item| {
                    from.slots.iter().position(|s| {
                        *s == Slot::Effect {
                            item,
                            parameter: *parameter,
                        }
                    })
                })
                .map(|k| x[k])
            }
            other => from.slots.iter().position(|s| s == other).map(|k| x[k]),
        };
        self.slots
            .iter()
            .map(|slot| value(slot).unwrap_or_else(|| default(slot)))
            .collect()
    }

    /// Names of the effects.
    pub fn names(&self) -> Vec<String> {
        self.items
            .iter()
            .map(|item| item.effect.name.to_owned())
            .collect()
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

fn base_slots(bench: &Bench, model: &Model) -> Vec<Slot> {
    let plant = driven_by(&model.kind, model.base(), bench.input);
    let winding = plant.inductance / plant.resistance;
    let told = |key: &str| match (&model.kind, key) {
        (Kind::DcMotor { .. }, "L_h") => {
            winding > NOTICEABLE_WINDING * plant.time_constant_s()
                && plant.drive == crate::system::plant::physics::Drive::Voltage
        }
        (Kind::DcMotor { .. }, "R_ohm" | "Ke_vs_per_rad") => {
            plant.drive == crate::system::plant::physics::Drive::Voltage
        }
        (Kind::DcMotor { .. }, "Kt_nm_per_a") => bench.input != crate::system::log::Input::Torque,
        _ => true,
    };
    let parameters = model
        .parameters()
        .into_iter()
        .filter(|(key, value)| *value > 0.0 && told(key));
    let slot = |(key, nominal)| {
        let tolerance = tolerance(model, key);
        (tolerance > 0.0).then_some(Slot::Base {
            key,
            nominal,
            tolerance,
        })
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
                slots.push(Slot::Known {
                    known,
                    parameter,
                    std,
                });
            }
        }
    }
    slots
}
