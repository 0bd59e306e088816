//! The numbers of a model with their standard deviations, and what those make of any number computed from them.

use truing_core::system::model::{KE, KT, Model};
use truing_core::system::plant::physics::Physics;
use truing_core::text::figures::significant;

/// A number of the model file.
pub struct Number {
    /// Its key, with the effect before it if it belongs to one.
    pub key: String,
    /// Value.
    pub value: f64,
    /// One standard deviation, if the file states one.
    pub std: Option<f64>,
    /// Where it came from, if the file says so.
    pub origin: Option<String>,
}

impl Number {
    /// `R_ohm = 2.2 ± 0.11 (run.csv)`
    pub fn told(&self) -> String {
        let origin = self.origin.as_ref().map_or(String::new(), |origin| format!(" ({origin})"));
        format!("{} = {}{origin}", self.key, with_spread(self.value, self.std))
    }
}

/// `2.2 ± 0.11`; a number without a deviation says so.
pub fn with_spread(value: f64, std: Option<f64>) -> String {
    let value = significant(value, 6);
    match std {
        Some(std) if std > 0.0 => format!("{value} ± {}", significant(std, 2)),
        _ => format!("{value}, ± not stated"),
    }
}

/// Every number of the file: the base, then each effect.
pub fn stated(model: &Model) -> Vec<Number> {
    let base = model.parameters().into_iter().map(|(key, value)| Number {
        key: key.to_owned(),
        value,
        std: Some(model.tolerance(model.stated(key)) * value.abs()),
        origin: None,
    });
    let known = model.known.iter().flat_map(|known| {
        let parameters = known.effect.parameters.iter().zip(&known.values).zip(&known.stds);
        parameters.map(|((parameter, value), std)| Number {
            key: format!("{}.{}", known.effect.name, parameter.name),
            value: *value,
            std: *std,
            origin: known.origin.clone(),
        })
    });
    base.chain(known).collect()
}

/// How a number follows from the plant.
pub type Of = fn(&Physics) -> f64;

/// A number computed from the plant, and one standard deviation of it: each number of the file is moved by its own, alone.
pub fn spread(model: &Model, of: impl Fn(&Physics) -> f64) -> (f64, f64) {
    let value = of(&model.physics());
    let moved = |model: &Model| (of(&model.physics()) - value).powi(2);
    let mut variance = 0.0;
    for (key, number) in model.parameters() {
        // A constant that the file states alone is Kt and Ke at once.
        if key == KE && model.constant.is_some() {
            continue;
        }
        let mut other = model.clone();
        let to = number * (1.0 + model.tolerance(model.stated(key)));
        other.set_parameter(key, to);
        if key == KT && model.constant.is_some() {
            other.set_parameter(KE, to);
        }
        variance += moved(&other);
    }
    for (place, known) in model.known.iter().enumerate() {
        for (which, std) in known.stds.iter().enumerate() {
            let Some(std) = std else { continue };
            let mut other = model.clone();
            other.known[place].values[which] += std;
            variance += moved(&other);
        }
    }
    (value, variance.sqrt())
}
