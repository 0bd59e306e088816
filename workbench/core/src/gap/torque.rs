//! A torque beside what a log shows of it.
//!
//! Without a measured current a log shows friction in volts at the terminals, level·R/Kt, and in rad/s², level/J. The torque itself
//! follows from what the model file says of R, Kt and J, and is as uncertain as they are.

use crate::gap::fit::hypothesis::{Data, is_open};
use crate::gap::fit::scored::Scored;
use crate::outcome::Value;
use crate::outcome::volts;
use crate::system::model::Kind;
use crate::system::plant::physics::{Drive, Physics};
use nalgebra::{DMatrix, DVector};

/// Volts and rad/s² are told where they are so many times sharper than the torque: a measured current shows the
/// torque, too. Chosen by judgement; not studied.
const SHARPER: f64 = 2.0;

/// A torque of an effect of a fitted set, or the difference of two.
pub struct Torque<'s, 'a, D> {
    /// The set.
    pub set: &'s Scored<'a, D>,
    /// The covariance of its numbers.
    pub covariance: &'s DMatrix<f64>,
    /// The effect and its parameter.
    pub place: (usize, usize),
    /// The parameter that is taken away.
    pub less: Option<usize>,
}

impl<D: Data> Torque<'_, '_, D> {
    fn at(&self, x: &[f64]) -> f64 {
        let value = |parameter| self.set.hypothesis.value(self.place.0, parameter, x);
        value(self.place.1) - self.less.map_or(0.0, value)
    }

    /// The torque times a figure of the plant, with its standard deviation.
    fn times(&self, unit: &str, figure: impl Fn(&Physics) -> f64) -> Value {
        let at = |x: &[f64]| self.at(x) * figure(&self.set.hypothesis.plant(x));
        let std = deviation(self.set, self.covariance, at);
        Value { value: at(&self.set.fit.x), std, unit: unit.into() }
    }

    /// Its standard deviation. That of a motor of 1 Ω, for which a first-order model stands, is that of the voltage.
    pub fn std(&self) -> Option<f64> {
        let gain = self.set.plant().torque_per_input();
        match self.set.hypothesis.model.kind {
            Kind::FirstOrder { .. } => Some(self.volts("V").std? * gain),
            _ => self.times("", |_| 1.0).std,
        }
    }

    fn volts(&self, unit: &str) -> Value {
        self.times(unit, |plant| 1.0 / plant.torque_per_input())
    }

    /// The voltage and, where the log `moves`, the acceleration that stand for it; none where the model knows torques as sharply.
    pub fn seen(&self, name: &str, unit: &str, moves: bool) -> Vec<(String, Value)> {
        let model = self.set.hypothesis.model;
        let first_order = matches!(model.kind, Kind::FirstOrder { .. });
        if self.set.plant().drive != Drive::Voltage || !(first_order || is_open(model)) {
            return Vec::new();
        }
        let (torque, voltage) = (self.times(unit, |_| 1.0), self.volts(&volts::unit(unit)));
        let blur = |value: &Value| value.std.map(|std| std / value.value.abs());
        let known = blur(&torque).zip(blur(&voltage)).is_some_and(|(torque, volts)| torque < SHARPER * volts);
        if known && !first_order {
            return Vec::new();
        }
        let acceleration = || self.times(volts::ACCELERATION, |plant| 1.0 / plant.inertia);
        let acceleration =
            (moves && unit == volts::TORQUE).then(|| (volts::acceleration_key(name), acceleration()));
        std::iter::once((volts::key(name), voltage)).chain(acceleration).collect()
    }
}

/// Standard deviation of a figure that follows from the numbers of a set: √(g Σ gᵀ), g by differences.
pub fn deviation<D: Data>(
    set: &Scored<D>,
    covariance: &DMatrix<f64>,
    figure: impl Fn(&[f64]) -> f64,
) -> Option<f64> {
    let at = figure(&set.fit.x);
    let slope = |j: usize| {
        let width = 1e-3 * covariance[(j, j)].sqrt().max(1e-12);
        let mut moved = set.fit.x.clone();
        moved[j] += width;
        (figure(&moved) - at) / width
    };
    let gradient = DVector::from_fn(set.fit.x.len(), |j, _| slope(j));
    let variance = gradient.dot(&(covariance * &gradient));
    (variance.is_finite() && variance >= 0.0).then(|| variance.sqrt())
}
