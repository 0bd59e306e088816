//! The predicted cost of a start, before it is fitted: the parent's numbers follow it linearly.

use crate::gap::fit::hypothesis::{Hypothesis, Slot};
use crate::gap::fit::jacobian::Jacobian;
use crate::gap::fit::problem::{Problem, dot};
use crate::gap::fit::scored::Scored;
use crate::gap::fit::{Evaluator, SEARCH};
use nalgebra::DVector;

/// The smallest multiple of a start's change of the residual that its predicted cost may assume: below it the
/// prediction is that of another start. Chosen by judgement; not studied.
const LEAST_SHARE: f64 = 0.3;
/// The largest multiple of that change: beyond it the linear prediction is not believed. Chosen by judgement; not
/// studied.
const MOST_SHARE: f64 = 2.0;
/// The smallest multiple for a candidate whose smallest start may be far too large for a small gap. Chosen by
/// judgement; not studied.
const SMALLEST_SHARE: f64 = 0.02;

/// A start after the parent's numbers followed.
pub(super) struct Start {
    /// Its predicted cost.
    pub predicted_cost: f64,
    /// The same if its size is left open.
    pub optimistic_cost: f64,
    /// Numbers at the whole start, the parent's followed.
    pub x: Vec<f64>,
    /// Numbers at the part of the start with the lowest predicted cost.
    pub part: Vec<f64>,
}

/// Numbers of a child from its parent and a start of the new effect.
pub(super) fn started(child: &Hypothesis, parent: &Scored, start: &[f64]) -> Vec<f64> {
    let new = child.items.len() - 1;
    let default = |slot: &Slot| match slot {
        Slot::Effect { item, parameter } if *item == new => start[*parameter],
        _ => 0.0,
    };
    let x = child.carried(&parent.hypothesis, &parent.fit.x, &default);
    x.iter().enumerate().map(|(k, v)| v.clamp(child.bounds(k).0, child.bounds(k).1)).collect()
}

/// Lets the parent's numbers follow a change of the residual, linearly and inside their bounds.
pub(super) struct Projector {
    jacobian: Jacobian,
    factor: nalgebra::Cholesky<f64, nalgebra::Dyn>,
    slots: Vec<Slot>,
    /// The parent's own residual.
    residuals: Vec<f64>,
}

impl Projector {
    pub(super) fn new(parent: &Scored) -> Self {
        let mut evaluator = Evaluator::new(&parent.hypothesis, &SEARCH);
        let mut residuals = Vec::new();
        evaluator.residuals(&parent.fit.x, &mut residuals);
        let mut jacobian = Jacobian::new(&evaluator, vec![Vec::new(); parent.fit.x.len()]);
        jacobian.renew(&mut evaluator, &parent.fit.x, &residuals, 0..parent.fit.x.len());
        let mut normal = jacobian.normal();
        for k in 0..parent.fit.x.len() {
            normal[(k, k)] = normal[(k, k)] * (1.0 + 1e-9) + 1e-9;
        }
        let factor = normal.cholesky().expect("made positive");
        Self { jacobian, factor, slots: parent.hypothesis.slots.clone(), residuals }
    }

    /// The parent's column of a number, unless it belongs to an effect.
    pub(super) fn column(&self, slot: &Slot) -> Option<Vec<f64>> {
        let place = self.slots.iter().position(|other| other == slot)?;
        slot.has_prior().then(|| self.jacobian.columns[place].clone())
    }

    /// The predicted cost of a start, and the start, after the parent's numbers followed. The prediction holds for the
    /// best multiple of the change, because the grid of starts is coarse.
    pub(super) fn projected(&self, child: &Hypothesis, x: &[f64], residuals: &[f64]) -> Start {
        let gradient: DVector<f64> = self.jacobian.gradient(residuals);
        let wanted = self.factor.solve(&-gradient);
        let (mut left, mut followed) = (residuals.to_vec(), x.to_vec());
        for (place, (slot, step)) in self.slots.iter().zip(wanted.iter()).enumerate() {
            let Some(twin) = child.slots.iter().position(|other| other == slot) else {
                continue;
            };
            let (lower, upper) = child.bounds(twin);
            followed[twin] = (x[twin] + step).clamp(lower, upper);
            self.jacobian.add(place, followed[twin] - x[twin], &mut left);
        }
        // The lowest cost on the way from the parent's residual through this one.
        let change: Vec<f64> = left.iter().zip(&self.residuals).map(|(l, r)| l - r).collect();
        let (slope, bend) = (dot(&self.residuals, &change), dot(&change, &change));
        let whole = dot(&self.residuals, &self.residuals);
        let share = |least: f64| (-slope / bend.max(1e-300)).clamp(least, MOST_SHARE);
        let along = |share: f64| whole + share * (2.0 * slope + share * bend);
        Start {
            predicted_cost: along(share(LEAST_SHARE)),
            optimistic_cost: along(share(SMALLEST_SHARE)),
            part: part(child, x, &followed, share(SMALLEST_SHARE)),
            x: followed,
        }
    }
}

/// A part of the way from no effect at all to a start, and of what the parent's numbers do on it. Thresholds and the like are
/// not sizes: they stay.
fn part(child: &Hypothesis, start: &[f64], followed: &[f64], share: f64) -> Vec<f64> {
    let new = child.items.len() - 1;
    let slots = child.slots.iter().zip(start.iter().zip(followed)).enumerate();
    slots
        .map(|(k, (slot, (start, followed)))| {
            let value = match slot {
                Slot::Effect { item, parameter } if *item == new => {
                    let effect = child.items[new].effect;
                    if effect.parameters[*parameter].is_size() { share * start } else { *start }
                }
                _ => start + share * (followed - start),
            };
            let (lower, upper) = child.bounds(k);
            value.clamp(lower, upper)
        })
        .collect()
}
