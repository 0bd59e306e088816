//! The accepted effects with their parameters, uncertainties and derived figures, and what the base moved.

use super::case::{Case, Found};
use super::rows::Rows;
use super::speed_unit::SpeedUnit;
use super::words;
use crate::gap::acceptance::prediction::sentence;
use crate::gap::fit::hypothesis::Slot;
use crate::gap::plots::curve::Placed;
use crate::gap::torque::{Torque, deviation};
use crate::outcome::volts;
use crate::outcome::*;
use crate::system::effects::{Effect, Parameter};
use std::collections::BTreeMap;

/// A deviation beyond this share of the parameter's range says that the rows do not feel it. Chosen by judgement; not
/// studied.
const UNFELT: f64 = 0.2;
/// A base parameter that moved by more than this share of its tolerance is reported. For display, chosen by
/// judgement.
const MOVED: f64 = 0.05;

impl Case<'_> {
    pub(super) fn effects(&self, found: &Found, unit: SpeedUnit) -> Vec<NamedEffect> {
        let steps = self.steps(found, unit);
        (0..found.set.hypothesis.items.len())
            .map(|k| {
                let effect = found.set.hypothesis.items[k].effect;
                let (before, after) = (&steps[k], &steps[k + 1]);
                let parameters = self.parameters(found, k);
                let values = found.set.hypothesis.values(k, &found.set.fit.x);
                NamedEffect {
                    name: effect.name.into(),
                    derived: derived(found, effect).chain(seen(found, k, &parameters)).collect(),
                    parameters,
                    gap_before: before.gap,
                    gap_after: after.gap,
                    evidence: sentence(effect, before, after, unit.name),
                    place: Placed { effect, values: &values, plant: &found.plant }
                        .words(["V", "rad/s"], self.log.u_v.iter().any(|u| *u < 0.0)),
                    tie: found.ties.iter().position(|t| t.0 == k),
                }
            })
            .collect()
    }

    /// Fitted parameters with deviations. A pinned parameter is part of the form: exact.
    fn parameters(&self, found: &Found, k: usize) -> BTreeMap<String, Value> {
        let hypothesis = &found.set.hypothesis;
        let item = &hypothesis.items[k];
        let parameters = item.effect.parameters.iter().enumerate();
        // An optional parameter at its default is not part of the simplest form.
        let told = parameters.filter(|(place, p)| item.pinned(*place).is_none() || p.default.is_none());
        let value = |(place, p): (usize, &Parameter)| {
            let slot = hypothesis.slot(k, place);
            let std = slot.and_then(|slot| Some(found.covariance.as_ref()?[(slot, slot)].sqrt()));
            // What the rows do not feel (a start from rest lies somewhere between two of them) has no deviation to state.
            let std = std.filter(|std| *std < UNFELT * (p.upper - p.lower));
            let value = Value {
                value: hypothesis.value(k, place, &found.set.fit.x),
                std: std.and_then(|std| match torque(found, k, place) {
                    Some(torque) => torque.std(),
                    None => Some(std * hypothesis.unit(p.scale, &found.set.fit.x)),
                }),
                unit: p.unit.into(),
            };
            (p.name.to_string(), value)
        };
        told.map(value).collect()
    }

    pub(super) fn within_tolerance(&self, found: &Found) -> Vec<Shift> {
        let hypothesis = &found.set.hypothesis;
        let slots = hypothesis.slots.iter().zip(&found.set.fit.x).enumerate();
        let shifts = slots.flat_map(|(slot, (moved, x))| match moved {
            Slot::Base { key, twin, tolerance, .. } if x.abs() > MOVED => {
                let ratio = (tolerance * x).exp();
                let covariance = found.covariance.as_ref();
                let std = covariance.map_or(1.0, |c| c[(slot, slot)].sqrt().min(1.0));
                let shift = |key: &str| Shift {
                    parameter: key.to_owned(),
                    shift_percent: 100.0 * (ratio - 1.0),
                    std_percent: 100.0 * ratio * tolerance * std,
                    refitted: hypothesis.model.fitted_to_log,
                };
                std::iter::once(*key).chain(twin.map(|twin| twin.0)).map(shift).collect()
            }
            _ => Vec::new(),
        });
        shifts.collect()
    }
}

fn derived(found: &Found, effect: &Effect) -> impl Iterator<Item = (String, Value)> {
    let told = effect.steady().map_or(Vec::new(), |steady| words::derived(steady.shape));
    let figures = told.into_iter().map(|(key, unit, figure)| {
        let at = |x: &[f64]| figure(&found.set.hypothesis.plant(x));
        let std = found.covariance.as_ref().and_then(|c| deviation(&found.set, c, at));
        (key.to_string(), Value { value: figure(&found.plant), std, unit: unit.into() })
    });
    figures.filter(|(_, v)| v.value.is_finite())
}

/// A fitted parameter of an effect that holds a torque.
fn torque<'f>(found: &'f Found, effect: usize, place: usize) -> Option<Torque<'f, 'f, Rows>> {
    let hypothesis = &found.set.hypothesis;
    let holds = hypothesis.items[effect].effect.parameters[place].unit.contains(volts::TORQUE);
    let covariance = found.covariance.as_ref().filter(|_| holds)?;
    Some(Torque { set: &found.set, covariance, place: (effect, place), less: None })
}

/// The voltages that stand for the torques of an effect.
fn seen(found: &Found, effect: usize, values: &BTreeMap<String, Value>) -> Vec<(String, Value)> {
    let parameters = found.set.hypothesis.items[effect].effect.parameters.iter().enumerate();
    let told = |(place, p): (usize, &Parameter)| {
        let felt = values[p.name].std.is_some();
        let seen = torque(found, effect, place)?.seen(p.name, p.unit, false).into_iter();
        Some(seen.map(move |(key, volts)| (key, Value { std: volts.std.filter(|_| felt), ..volts })))
    };
    let told = parameters.filter(|(_, p)| values.contains_key(p.name)).filter_map(told);
    told.flatten().collect()
}

/// Edges and knees for the plots.
pub(super) fn marks(effects: &[NamedEffect]) -> Vec<(f64, String)> {
    let labels = [("knee_command_v", "knee"), ("stops_above_v", "dead zone"), ("stops_below_v", "dead zone")];
    let all = effects.iter().flat_map(|e| &e.derived);
    let mark = |(key, v): (&String, &Value)| {
        let label = labels.iter().find(|l| l.0 == key)?;
        Some((v.value, format!("{} {} V", label.1, crate::text::figures::figure(v.value))))
    };
    all.filter_map(mark).collect()
}
