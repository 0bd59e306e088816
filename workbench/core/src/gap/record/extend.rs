//! The model of a record, extended by what was found, and what it predicts: the one result.

use crate::gap::acceptance::prediction::{HeldOut, compared, position_gap, sentence};
use crate::gap::dataset::{Dataset, FullPass};
use crate::gap::fit::hypothesis::{Hypothesis, Slot};
use crate::gap::fit::samples::{Sample, seen};
use crate::gap::fit::{FINAL, Fit};
use crate::gap::plots::curve::{self, Placed};
use crate::gap::record::estimate::{self, Estimate, Estimates, Uncertainty};
use crate::gap::record::verdict::Judged;
use crate::gap::record::{excitation, sentences, sides};
use crate::gap::remainder::{self, Described};
use crate::gap::search::{Found, Scored};
use crate::gap::{experiment, plots};
use crate::outcome::*;
use crate::system::effects::{self, Domain, Effect, Parameter};
use crate::system::model::Model;
use crate::system::threads::*;
use std::collections::BTreeMap;

/// Numbers that moved beside no name get a step and a curve of their own where they make the held-out gap so many times smaller: less is not
/// seen. Chosen by judgement; not studied.
const MOVED: f64 = 0.9;

/// The model as given beside the data.
pub(super) struct Given<'a> {
    /// The model without any effect.
    pub set: Scored<'a>,
    /// What it predicts of the held-out data.
    pub held_out: HeldOut,
    /// What is measured and what it does, with the time since the last reversal.
    pub seen: (Vec<Sample>, Vec<f64>),
    /// All rows of a long log.
    pub whole: Option<&'a FullPass<'a>>,
}

impl<'a> Given<'a> {
    pub(super) fn simulated(dataset: &'a Dataset, model: &'a Model, whole: Option<&'a FullPass<'a>>) -> Self {
        let set = Scored::given(dataset, model);
        let (held_out, seen) = join(|| HeldOut::of(whole, &set), || seen(whole, &set));
        Self { set, held_out, seen, whole }
    }

    /// The held-out gap of a set.
    fn gap_of(&self, set: &Scored) -> f64 {
        HeldOut::of(self.whole, set).gap
    }
}

/// The result of a search, with the kept set added to the model.
pub(super) fn extended(
    given: &Given,
    found: &Found,
    mut judged: Judged,
    described: Option<&Described>,
    last: Option<&Last>,
) -> Outcome {
    let dataset = given.set.hypothesis.dataset;
    let fitted = described.and_then(|described| described.fitted.as_ref());
    let with_term = fitted.map(|fitted| fitted.beside(&judged.kept));
    let kept = with_term.as_ref().unwrap_or(&judged.kept);
    let known = judged.uncertainty.take().filter(|_| with_term.is_none());
    let two_sided = |k| sides::told(kept, k, |set| given.gap_of(set));
    let ((mut steps, sides), ((after, seen_after), (uncertainty, rivals))) = join(
        || join(|| steps(given, &judged.kept), || of_each(0..kept.hypothesis.items.len(), two_sided)),
        || {
            let beside = || {
                let rivals = || sentences::rivals(found, &judged.ties, |set| given.gap_of(set));
                join(|| known.unwrap_or_else(|| Uncertainty::of(kept)), rivals)
            };
            let simulated = || join(|| HeldOut::of(given.whole, kept), || seen(given.whole, kept).0);
            join(simulated, beside)
        },
    );
    let unnamed = fitted.map(|fitted| {
        let gaps = (given.gap_of(&judged.kept), after.gap);
        let term = remainder::as_told(&judged.kept, fitted, gaps);
        steps.push(Step { label: format!("+ {}", term.name), gap: term.gap_after });
        term
    });
    let position = position(given, kept);
    let held_out = compared(dataset.signal, dataset.sigma, given.held_out, after);
    Outcome {
        unexplained: unexplained(&judged, described, unnamed),
        grade: judged.grade,
        small: [found.small.clone(), judged.tiny].concat(),
        effects: named(kept, &uncertainty, &steps, &judged.ties, sides),
        closest_known: judged.closest,
        notes: notes(given, found, position.as_ref()),
        position,
        final_records: last.map(|last| predicted(last, given.set.hypothesis.model, kept)),
        within_tolerance: shifts(kept, &uncertainty),
        next_experiment: judged.next.map(|next| experiment::with_needs(next, kept)),
        searched: dataset.searched,
        rivals,
        plots: all_plots(given, kept, &seen_after, after.gap, described),
        ties: judged.ties,
        steps,
        ..Outcome::new(judged.verdict, held_out, dataset.unit())
    }
}

/// What no name explains.
fn unexplained(judged: &Judged, described: Option<&Described>, unnamed: Option<UnnamedTerm>) -> Unexplained {
    Unexplained {
        share_of_gap: judged.share,
        structure: judged.structure.to_string(),
        depends_on: described.map_or(Vec::new(), Described::keys),
        predicts_share: described.map(|described| described.share),
        noise_like: judged.noisy,
        unnamed,
    }
}

/// The curves of the effects, data with both models, and what is left over what it depends on. `gap`: that of the kept set.
fn all_plots(
    given: &Given,
    kept: &Scored,
    with: &[Sample],
    gap: f64,
    described: Option<&Described>,
) -> Vec<Plot> {
    let described_by_term = described.is_some_and(|described| described.fitted.is_some());
    let later = match described_by_term || !kept.hypothesis.items.is_empty() {
        true => Some("extended model"),
        false => (gap < MOVED * given.held_out.gap).then_some("with its numbers moved"),
    };
    let data = plots::all(&given.set.hypothesis, &given.seen.0, with, later);
    let curves = curves(given, kept, with).into_iter();
    curves.chain(data).chain(described.map(|described| described.plot.clone())).collect()
}

/// What the reader must know.
fn notes(given: &Given, found: &Found, position: Option<&PositionGap>) -> Vec<String> {
    let (dataset, model) = (given.set.hypothesis.dataset, given.set.hypothesis.model);
    let lost = position.filter(|it| it.rmse_after > it.rmse_before).map(|_| LOSES.to_owned());
    let of_log = dataset.notes.iter().cloned().chain(vetoed(model, found));
    of_log.chain(excitation::missing(dataset)).chain(lost).collect()
}

/// Said where the second judge disagrees.
const LOSES: &str = "the extended model predicts the speed better and the position worse: do not trust where it says that the shaft is";

/// How far the model as given and the extended one miss the logged position.
fn position(given: &Given, kept: &Scored) -> Option<PositionGap> {
    let (rmse_before, rmse_after) = (position_gap(&given.set)?, position_gap(kept)?);
    let unit = if kept.hypothesis.dataset.linear { "m" } else { "rad" };
    Some(PositionGap { rmse_before, rmse_after, unit })
}

/// The curves of the effects that are one over a variable.
fn curves(given: &Given, kept: &Scored, with: &[Sample]) -> Vec<Plot> {
    let items = &kept.hypothesis.items;
    let places = (0..items.len()).filter(|k| items[*k].effect.domain != Domain::Nowhere);
    let plot = |k: usize| {
        let without = kept.lacking(k);
        curve::plot(kept, k, with, (&without.plant(), &seen(given.whole, &without).0))
    };
    each(places.collect::<Vec<usize>>()).filter_map(plot).collect()
}

/// Records that are only predicted.
pub(super) struct Last<'a> {
    /// Made ready.
    pub dataset: Dataset,
    /// All rows of them, where they are long.
    pub whole: Option<FullPass<'a>>,
}

/// What the set predicts for the held-out part of another dataset of the same log.
fn predicted(last: &Last, model: &Model, kept: &Scored) -> HoldOut {
    let (dataset, whole) = (&last.dataset, last.whole.as_ref());
    let hypothesis = Hypothesis::new(dataset, kept.hypothesis.model, kept.hypothesis.items.clone());
    let x = hypothesis.carried(&kept.hypothesis, &kept.fit.x, &|_| 0.0);
    let extended = Scored { hypothesis, fit: Fit { x, ..kept.fit.clone() }, score: kept.score };
    let before = HeldOut::of(whole, &Scored::given(dataset, model));
    compared(dataset.signal, dataset.sigma, before, HeldOut::of(whole, &extended))
}

/// What the held-out records had to say about names by shares.
fn vetoed(model: &Model, found: &Found) -> Vec<String> {
    let chosen = model.by_shares && !found.best.hypothesis.items.is_empty();
    let told = "the held-out records had a veto: a name stays only if every one of them is predicted better with it. A further record given with --final is only predicted";
    chosen.then(|| told.to_owned()).into_iter().collect()
}

/// The held-out gap of the model as given, and after each effect in the order of naming.
fn steps(given: &Given, best: &Scored) -> Vec<Step> {
    let first = Step { label: "the model as given".into(), gap: given.held_out.gap };
    let items = &best.hypothesis.items;
    let further = of_each(1..items.len() + 1, |count| {
        let set = (count < items.len()).then(|| best.only(|k| k < count, &FINAL));
        let gap = given.gap_of(set.as_ref().unwrap_or(best));
        Step { label: format!("+ {}", items[count - 1].effect.name), gap }
    });
    let moved =
        items.is_empty().then(|| Step { label: "with its numbers moved".into(), gap: given.gap_of(best) });
    let moved = moved.filter(|step| step.gap < MOVED * first.gap);
    std::iter::once(first).chain(moved).chain(further).collect()
}

/// The accepted effects with their parameters and uncertainties.
fn named(
    kept: &Scored,
    uncertainty: &Uncertainty,
    steps: &[Step],
    ties: &[Tie],
    sides: Vec<Option<String>>,
) -> Vec<NamedEffect> {
    let (dataset, plant) = (kept.hypothesis.dataset, kept.plant());
    let linear = dataset.linear;
    let both = dataset.runs.iter().any(|run| run.input.iter().any(|input| *input < 0.0));
    let units = [dataset.input.unit(), if linear { "m/s" } else { "rad/s" }];
    let told = |it: &Estimate| parameter(it.parameter, it.value, it.std, linear);
    let effect = |(k, (estimates, sides)): (usize, (Estimates, Option<String>))| {
        let effect = kept.hypothesis.items[k].effect;
        let name = effect.name.to_owned();
        let values = kept.hypothesis.values(k, &kept.fit.x);
        let place = steps
            .iter()
            .position(|step| step.label.strip_prefix("+ ") == Some(&name))
            .unwrap_or(steps.len() - 1)
            .max(1);
        NamedEffect {
            gap_before: steps[place - 1].gap,
            gap_after: steps[place].gap,
            evidence: [sentence(effect, &steps[place - 1], &steps[place], dataset.unit())]
                .into_iter()
                .chain(sides)
                .collect::<Vec<String>>()
                .join(" "),
            place: Placed { effect, values: &values, plant: &plant }.words(units, both),
            tie: ties.iter().position(|tie| tie.rivals[0].contains(&name)),
            name,
            parameters: estimates.numbers.iter().map(told).collect(),
            derived: derived(effect, estimates, linear),
        }
    };
    let told = estimate::estimates(kept, uncertainty).into_iter().zip(sides);
    told.enumerate().map(effect).collect()
}

/// Key and value of a parameter on a turning or a linear axis.
fn parameter(spec: &Parameter, value: f64, std: Option<f64>, linear: bool) -> (String, Value) {
    let (key, unit) = if linear {
        (effects::linear_key(spec.name), effects::linear_unit(spec.unit))
    } else {
        (spec.name.into(), spec.unit.into())
    };
    (key, Value { value, std, unit })
}

/// What stands for its torques, and the difference of its two sides.
fn derived(effect: &Effect, estimates: Estimates, linear: bool) -> BTreeMap<String, Value> {
    let difference = estimates.between_sides.zip(effect.sides()).map(|((torque, volts), sides)| {
        let key = |side: usize| parameter(&effect.parameters[side], 0.0, None, linear).0;
        let (one, other) = (key(sides.0), key(sides.1));
        match volts {
            Some(volts) => (format!("{}_minus_{}", volts::key(&one), volts::key(&other)), volts),
            None => {
                let (_, value) = parameter(&effect.parameters[sides.0], torque.value, torque.std, linear);
                (format!("{one}_minus_{other}"), value)
            }
        }
    });
    estimates.numbers.into_iter().flat_map(|estimate| estimate.seen).chain(difference).collect()
}

/// Base parameters and parameters of known effects that moved inside their tolerances.
fn shifts(kept: &Scored, uncertainty: &Uncertainty) -> Vec<Shift> {
    let deviations = uncertainty.deviations();
    let slots = kept.hypothesis.slots.iter().enumerate();
    slots
        .filter_map(|(k, slot)| match slot {
            Slot::Base { key, tolerance, .. } => Some(Shift {
                parameter: kept.hypothesis.model.stated(key).to_owned(),
                shift_percent: 100.0 * ((tolerance * kept.fit.x[k]).exp() - 1.0),
                std_percent: 100.0 * tolerance * deviations[k].min(1.0),
                refitted: kept.hypothesis.model.fitted_to_log,
            }),
            Slot::Known { known, parameter, std } => {
                let known = &kept.hypothesis.model.known[*known];
                let (value, spec) = (known.values[*parameter], &known.effect.parameters[*parameter]);
                (value != 0.0).then(|| Shift {
                    parameter: format!("known.{}.{}", known.effect.name, spec.name),
                    shift_percent: 100.0 * std * kept.fit.x[k] / value,
                    std_percent: 100.0 * (std / value).abs() * deviations[k].min(1.0),
                    refitted: false,
                })
            }
            _ => None,
        })
        .collect()
}
