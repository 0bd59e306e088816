//! The accepted effects with their parameters, uncertainties and derived figures, and what the base moved.

use super::study::deviation;
use super::verdict::{Case, Found};
use super::words::{self, SpeedUnit};
use crate::outcome::*;
use crate::system::effects::{Effect, Shape};
use std::collections::BTreeMap;

/// A deviation beyond this share of the parameter's range says that the rows do not feel it.
const UNFELT: f64 = 0.2;
/// A base parameter that moved by more than this share of its tolerance is reported.
const MOVED: f64 = 0.05;

impl Case<'_> {
    pub(super) fn effects(&self, found: &Found, unit: SpeedUnit) -> Vec<NamedEffect> {
        let steps = self.steps(found, unit);
        (0..found.fit.forms.len())
            .map(|k| {
                let effect = found.fit.forms[k].effect;
                let (before, after) = (steps[k].gap, steps[k + 1].gap);
                let shape = shape(effect);
                let text = words::evidence(shape, &found.plant, self.search.problem.base, unit);
                NamedEffect {
                    name: effect.name.into(),
                    parameters: self.parameters(found, k),
                    derived: derived(found, shape),
                    gap_before: before,
                    gap_after: after,
                    evidence: format!(
                        "{}; on held-out rows the gap goes from {} to {} {}.",
                        capitalised(&text),
                        crate::report::gap(before),
                        crate::report::gap(after),
                        unit.name
                    ),
                    tie: found.ties.iter().position(|t| t.0 == k),
                }
            })
            .collect()
    }

    /// Fitted parameters with deviations. A pinned parameter is part of the form: exact.
    fn parameters(&self, found: &Found, k: usize) -> BTreeMap<String, Value> {
        let form = &found.fit.forms[k];
        let mut index: usize = found.fit.forms[..k].iter().map(|f| f.size()).sum();
        let mut parameters = BTreeMap::new();
        for ((p, value), pin) in form
            .effect
            .parameters
            .iter()
            .zip(found.fit.values(k))
            .zip(&form.pinned)
        {
            let free = pin.is_none();
            let range = (p.upper - p.lower) * found.problem.natural.unit(p.scale);
            let std = found
                .covariance
                .as_ref()
                .filter(|_| free)
                .map(|c| c[(index, index)].sqrt());
            // What the rows do not feel (a start from rest lies somewhere between two of them) has no deviation to state.
            let std = std.filter(|std| *std < UNFELT * range);
            index += usize::from(free);
            // An optional parameter at its default is not part of the simplest form.
            if free || p.default.is_none() {
                parameters.insert(
                    p.name.to_string(),
                    Value {
                        value,
                        std,
                        unit: p.unit.into(),
                    },
                );
            }
        }
        parameters
    }

    pub(super) fn within_tolerance(&self, found: &Found) -> Vec<Shift> {
        let size = found.fit.size();
        let nuisances = found.problem.nuisances.iter().enumerate();
        let moved = nuisances.filter(|(j, n)| found.fit.shifts()[*j].abs() > MOVED * n.tolerance);
        let shift = |(j, n): (usize, &super::fit::Nuisance)| {
            let ratio = found.fit.shifts()[j].exp();
            let std = found
                .covariance
                .as_ref()
                .map_or(n.tolerance, |c| c[(size + j, size + j)].sqrt().min(n.tolerance));
            n.keys.iter().map(move |key| Shift {
                parameter: key.to_string(),
                shift_percent: 100.0 * (ratio - 1.0),
                std_percent: 100.0 * ratio * std,
                refitted: false,
            })
        };
        moved.flat_map(shift).collect()
    }
}

/// What the effect does to the curve. One that no table names is told by its summary; the search offers none.
fn shape(effect: &Effect) -> Shape {
    let steady = effect.steady();
    steady.map_or(Shape::Told(effect.summary), |steady| steady.shape)
}

fn derived(found: &Found, shape: Shape) -> BTreeMap<String, Value> {
    let figures = words::derived(shape).into_iter().map(|(key, unit, figure)| {
        let std = found
            .covariance
            .as_ref()
            .and_then(|c| deviation(found.problem, &found.fit, c, figure));
        (
            key.to_string(),
            Value {
                value: figure(&found.plant),
                std,
                unit: unit.into(),
            },
        )
    });
    figures.filter(|(_, v)| v.value.is_finite()).collect()
}

/// Edges and knees for the plots.
pub(super) fn marks(effects: &[NamedEffect]) -> Vec<(f64, String)> {
    let labels = [
        ("knee_command_v", "knee"),
        ("stops_above_v", "dead zone"),
        ("stops_below_v", "dead zone"),
    ];
    let all = effects.iter().flat_map(|e| &e.derived);
    let mark = |(key, v): (&String, &Value)| {
        let label = labels.iter().find(|l| l.0 == key)?;
        Some((v.value, format!("{} {} V", label.1, words::figure(v.value))))
    };
    all.filter_map(mark).collect()
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
