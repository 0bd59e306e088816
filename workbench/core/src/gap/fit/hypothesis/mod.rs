//! A hypothesis: the base model with a set of effects, as a vector of numbers that a fit may move.
//!
//! Every base parameter moves inside its tolerance in every fit (a prior of one tolerance, bounds of two): a model
//! file that is off by its tolerance must not make an effect, and must not hide one.

mod item;
mod record;

pub use item::{Freedom, Item};
pub use record::{is_open, tolerance};

use crate::gap::dataset::{Dataset, Scales};
use crate::system::effects::{Effect, Parameter, Scale, Starts};
use crate::system::model::{KT, Kind, Model};
use crate::system::plant::physics::Physics;

/// How far a nuisance may move, in its standard deviations. A Gaussian prior alone does not hold against a long log.
/// Origin: decision 0032.
pub const NUISANCE_BOUND: f64 = 2.0;

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

    /// Smallest value of a parameter, in units of its scale.
    fn least(&self, parameter: &Parameter) -> f64 {
        parameter.lower
    }

    /// The plant of base parameters, without any effect.
    fn base(&self, model: &Model, kind: &Kind) -> Physics;

    /// True if an effect that the model already contains shows in such data.
    fn shows(&self, _known: &Effect) -> bool {
        true
    }

    /// Puts right what several effects together make impossible.
    fn tidy(&self, _plant: &mut Physics) {}
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
#[derive(Clone, Debug)]
pub struct Hypothesis<'a, D = Dataset> {
    /// What is compared.
    pub dataset: &'a D,
    /// The model as given.
    pub model: &'a Model,
    /// The effects in the order of naming.
    pub items: Vec<Item>,
    /// What the numbers stand for: the effects' parameters first.
    pub slots: Vec<Slot>,
}

impl<'a, D: Data> Hypothesis<'a, D> {
    /// The base model with these effects.
    pub fn new(dataset: &'a D, model: &'a Model, items: Vec<Item>) -> Self {
        let own = |(item, it): (usize, &Item)| {
            let slot = |parameter| Slot::Effect { item, parameter };
            it.free().map(slot).collect::<Vec<Slot>>()
        };
        let mut slots: Vec<Slot> = items.iter().enumerate().flat_map(own).collect();
        slots.extend(dataset.nuisances(model));
        Self { dataset, model, items, slots }
    }

    /// The same data and model with other effects.
    pub fn with(&self, items: Vec<Item>) -> Self {
        Self::new(self.dataset, self.model, items)
    }

    /// The same with another item in the place of one.
    pub fn with_item(&self, index: usize, item: Item) -> Self {
        let mut items = self.items.clone();
        items[index] = item;
        self.with(items)
    }

    /// The same with one item more.
    pub fn with_more(&self, item: Item) -> Self {
        self.with([&self.items[..], &[item]].concat())
    }

    /// Does it hold an effect whose cost is rugged?
    pub fn is_rugged(&self) -> bool {
        self.items.iter().any(|item| matches!(item.effect.starts, Starts::Rugged(..)))
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
                (self.dataset.least(parameter), parameter.upper)
            }
            Slot::Base { .. } => {
                let reach = self.dataset.reach(self.model);
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
        self.dataset.step(&self.slots[slot], parameter)
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
            Some(slot) => x[slot] * self.unit(spec.scale, x),
            None => self.items[item].pinned(parameter).unwrap_or(0.0),
        }
    }

    /// What one unit of a scale means while the base has moved. A motor's torque is counted by the input that it takes: a log without a current
    /// shows friction in volts (torque·R/Kt) sharply and in N m not at all, so that R, Kt and J can move and friction stays.
    pub fn unit(&self, scale: Scale, x: &[f64]) -> f64 {
        let moved = |(slot, z): (&Slot, &f64)| match slot {
            Slot::Base { key: KT, tolerance, .. } => tolerance * z,
            Slot::Base { key: "R_ohm", tolerance, .. } => -tolerance * z,
            _ => 0.0,
        };
        let unit = self.dataset.scales().of(scale);
        match scale.is_torque() {
            true => unit * self.slots.iter().zip(x).map(moved).sum::<f64>().exp(),
            false => unit,
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
            if !self.dataset.shows(known.effect) {
                continue;
            }
            let mut values = known.values.clone();
            for (slot, z) in self.slots.iter().zip(x) {
                if let Slot::Known { known, parameter, std } = slot
                    && *known == index
                {
                    values[*parameter] += std * z;
                }
            }
            (known.effect.apply)(&values, &mut plant);
        }
        for (item, it) in self.items.iter().enumerate() {
            (it.effect.apply)(&self.values(item, x), &mut plant);
        }
        self.dataset.tidy(&mut plant);
        plant
    }

    /// The base with its moved parameters, without known effects.
    fn base(&self, x: &[f64]) -> Physics {
        self.dataset.base(self.model, &self.kind(x))
    }

    /// The base parameters where they have moved to.
    pub fn kind(&self, x: &[f64]) -> Kind {
        let mut kind = self.model.kind;
        for (slot, z) in self.slots.iter().zip(x) {
            if let Slot::Base { key, nominal, tolerance, twin } = slot {
                let ratio = (tolerance * z).exp();
                for (key, nominal) in std::iter::once((*key, *nominal)).chain(*twin) {
                    kind.set(key, nominal * ratio);
                }
            }
        }
        kind
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
