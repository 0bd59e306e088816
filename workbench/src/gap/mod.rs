//! The gap workflow in plain words: log → simulate → residual → localise → name → extend.

pub mod beam;
pub mod dataset;
pub mod estimate;
pub mod evidence;
pub mod excitation;
pub mod expectation;
pub mod experiment;
pub mod fit;
pub mod hypothesis;
pub mod initial_guesses;
pub mod localise;
pub mod plots;
pub mod prediction;
pub mod residual;
pub mod residual_tests;
pub mod samples;
pub mod search;
pub mod solver;
pub mod tables;
pub mod time_base;
pub mod verdict;

use crate::console::input_error::InputError;
use crate::gap::dataset::{Bench, Part, hf_noise, prepare};
use crate::gap::estimate::Estimate;
use crate::gap::fit::{FINAL, covariance};
use crate::gap::hypothesis::Hypothesis;
use crate::gap::prediction::{Prediction, held_out_errors};
use crate::gap::residual::{fit_percent, rms};
use crate::gap::residual_tests::{sensor_like, twin_pairs};
use crate::gap::samples::samples;
use crate::gap::search::{Found, Progress, Scored, base_fit, search};
use crate::outcome::*;
use crate::report::volts;
use crate::system::effects;
use crate::system::log::Dynamic;
use crate::system::model::Model;
use std::collections::BTreeMap;
use std::time::Instant;

/// What the user may choose.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Effects that are not offered.
    pub without: Vec<String>,
    /// Records that are only predicted, at the very end: the held-out records may refuse names, these choose nothing.
    pub finals: Vec<Dynamic>,
}

/// Finds where model and log disagree, names what is missing and predicts the held-out data with it.
pub fn run(
    model: &Model,
    log: &Dynamic,
    holdouts: &[Dynamic],
    options: &Options,
    progress: Progress,
) -> Result<Outcome, InputError> {
    let started = Instant::now();
    let bench = made_ready(model, log, holdouts)?;
    if let Some(outcome) = verdict::not_excited(&bench) {
        return Ok(outcome);
    }
    let copy = |last: &&Dynamic| holdouts.iter().any(|held| dataset::same(held, last));
    if let Some(copy) = options.finals.iter().find(copy) {
        let what = "is one of the held-out records, which had a veto; give --final another record";
        return Err(InputError::file(&copy.source, what));
    }
    let last = match &options.finals[..] {
        [] => None,
        finals => Some(made_ready(model, log, finals)?),
    };
    let found = search(&bench, model, &options.without, progress);
    let mut outcome = concluded(&bench, model, &found, last.as_ref());
    outcome.runtime_s = started.elapsed().as_secs_f64();
    Ok(outcome)
}

/// Log and hold-outs on their grids, with noise and weights.
pub fn made_ready(model: &Model, log: &Dynamic, holdouts: &[Dynamic]) -> Result<Bench, InputError> {
    let mut bench = prepare(model, log, holdouts)?;
    settle_noise(&mut bench, model);
    Ok(bench)
}

/// The noise from the base's residual, in which the motion no longer hides it, and the weights.
fn settle_noise(bench: &mut Bench, model: &Model) {
    let nominal = Hypothesis::new(bench, model, Vec::new());
    let plant = nominal.plant(&vec![0.0; nominal.slots.len()]);
    bench.weigh(&plant);
    let base = base_fit(bench, model);
    let view = Prediction::of(&base.hypothesis, &base.fit.x, &[Part::A, Part::B]);
    let residual: Vec<f64> = view
        .measured
        .iter()
        .zip(&view.predicted)
        .map(|(y, p)| y - p)
        .collect();
    let high = hf_noise(&residual, bench.noise_lag).clamp(0.5 * bench.sigma, 1.05 * bench.sigma);
    let repeated = repeated_noise(&base);
    let plant = base.hypothesis.plant(&base.fit.x);
    bench.sigma = repeated.map_or(high, |sigma| sigma.max(high));
    bench.weigh(&plant);
}

/// The noise from the difference of two runs with the same input: it needs no model of the noise.
fn repeated_noise(base: &Scored) -> Option<f64> {
    let bench = base.hypothesis.bench;
    let seen = samples(&base.hypothesis, &base.fit.x, &[Part::A, Part::B]);
    let differences: Vec<f64> = twin_pairs(&seen, bench.twins?, |s| s.residual())
        .map(|(a, b)| a - b)
        .collect();
    let enough = differences.len() > 200 && sensor_like(&differences);
    enough.then(|| rms(&differences) / 2f64.sqrt())
}

/// From what was found to the one result.
fn concluded(bench: &Bench, model: &Model, found: &Found, last: Option<&Bench>) -> Outcome {
    let given = Hypothesis::new(bench, model, Vec::new());
    let nominal = vec![0.0; given.slots.len()];
    let before = Prediction::of(&given, &nominal, &[Part::HoldOut]);
    let mut judged = verdict::judge(found, &given, &nominal);
    let eased = estimate::eased(&judged.kept);
    if let Some(eased) = &eased {
        let anew = estimate::refitted(eased, &judged.kept);
        if !model.fitted_to_log || predicts_as_well(&anew, &judged.kept) {
            judged.kept = anew;
        }
    }
    let steps = steps(&judged.kept, before.gap());
    let after = Prediction::of(&judged.kept.hypothesis, &judged.kept.fit.x, &[Part::HoldOut]);
    let effects = volts::told(model, named(&judged.kept, &steps, &judged.ties));
    Outcome {
        schema: "truing-gap/1",
        verdict: judged.verdict,
        effects,
        closest_known: judged.closest.clone(),
        holdout: held_out(bench, &before, &after),
        final_records: last.map(|bench| predicted(bench, &judged.kept)),
        within_tolerance: shifts(&judged.kept),
        places: localise::places(&given, &nominal),
        unexplained: judged.unexplained.clone(),
        next_experiment: judged.next.clone(),
        runtime_s: 0.0,
        notes: [
            bench.notes.clone(),
            vetoed(model, found),
            excitation::missing(bench),
        ]
        .concat(),
        rivals: evidence::rivals(found, &judged.ties),
        plots: plots::all(&given, &nominal, &judged.kept),
        ties: judged.ties,
        steps,
        gap_unit: unit_of_gap(bench.linear).into(),
    }
}

/// By how much more of a held-out record's squared error other weights may leave.
const AS_WELL: f64 = 1.1;

/// Whether a set fitted with other weights predicts every held-out record as well.
fn predicts_as_well(anew: &Scored, kept: &Scored) -> bool {
    let errors = |set: &Scored| held_out_errors(&set.hypothesis, &set.fit.x);
    errors(anew)
        .iter()
        .zip(errors(kept))
        .all(|(anew, kept)| *anew <= AS_WELL * kept)
}

/// How well measured values are predicted before and after.
fn held_out(bench: &Bench, before: &Prediction, after: &Prediction) -> HoldOut {
    HoldOut {
        signal: bench.signal.to_owned(),
        rmse_before: before.gap(),
        rmse_after: after.gap(),
        noise_floor: bench.sigma,
        fit_percent_before: fit_percent(&before.measured, &before.predicted),
        fit_percent_after: fit_percent(&after.measured, &after.predicted),
    }
}

/// What the set predicts for the held-out part of another bench of the same log.
fn predicted(bench: &Bench, kept: &Scored) -> HoldOut {
    let model = kept.hypothesis.model;
    let made = |hypothesis: &Hypothesis, x: &[f64]| Prediction::of(hypothesis, x, &[Part::HoldOut]);
    let given = Hypothesis::new(bench, model, Vec::new());
    let extended = Hypothesis::new(bench, model, kept.hypothesis.items.clone());
    let x = extended.carried(&kept.hypothesis, &kept.fit.x, &|_| 0.0);
    let before = made(&given, &vec![0.0; given.slots.len()]);
    held_out(bench, &before, &made(&extended, &x))
}

/// What the held-out records had to say about the names of a model that is a fit to the log.
fn vetoed(model: &Model, found: &Found) -> Vec<String> {
    let chosen = model.fitted_to_log && !found.best.hypothesis.items.is_empty();
    chosen
        .then(|| {
            "the held-out records had a veto: a name stays only if every one of them is predicted better with it. A further record given with --final is only predicted".to_owned()
        })
        .into_iter()
        .collect()
}

/// The held-out gap of the model as given, and after each effect in the order of naming.
fn steps(best: &Scored, given: f64) -> Vec<Step> {
    let mut steps = vec![Step {
        label: "the model as given".into(),
        gap: given,
    }];
    for count in 1..=best.hypothesis.items.len() {
        let hypothesis = Hypothesis::new(
            best.hypothesis.bench,
            best.hypothesis.model,
            best.hypothesis.items[..count].to_vec(),
        );
        let start = hypothesis.carried(&best.hypothesis, &best.fit.x, &|_| 0.0);
        let x = if count == best.hypothesis.items.len() {
            start
        } else {
            crate::gap::fit::fit(&hypothesis, &start, &FINAL).x
        };
        let gap = Prediction::of(&hypothesis, &x, &[Part::HoldOut]).gap();
        steps.push(Step {
            label: format!("+ {}", best.hypothesis.items[count - 1].effect.name),
            gap,
        });
    }
    steps
}

/// The accepted effects with their parameters and uncertainties.
fn named(kept: &Scored, steps: &[Step], ties: &[Tie]) -> Vec<NamedEffect> {
    let linear = kept.hypothesis.bench.linear;
    let effect = |(item, estimates): (&crate::gap::hypothesis::Item, Vec<Estimate>)| {
        let name = item.effect.name.to_owned();
        let place = steps
            .iter()
            .position(|step| step.label.strip_prefix("+ ") == Some(&name))
            .unwrap_or(steps.len() - 1)
            .max(1);
        NamedEffect {
            gap_before: steps[place - 1].gap,
            gap_after: steps[place].gap,
            evidence: evidence::sentence(item.effect, &steps[place - 1], &steps[place], unit_of_gap(linear)),
            tie: ties.iter().position(|tie| tie.rivals[0].contains(&name)),
            name,
            parameters: estimates
                .iter()
                .map(|estimate| parameter(estimate, linear))
                .collect(),
            derived: BTreeMap::new(),
        }
    };
    let items = kept.hypothesis.items.iter();
    items.zip(estimate::estimates(kept)).map(effect).collect()
}

/// Key and value of a parameter on a turning or a linear axis.
fn parameter(estimate: &Estimate, linear: bool) -> (String, Value) {
    let spec = estimate.parameter;
    let (key, unit) = if linear {
        (effects::linear_key(spec.name), effects::linear_unit(spec.unit))
    } else {
        (spec.name.into(), spec.unit.into())
    };
    let (value, std) = (estimate.value, estimate.std);
    (key, Value { value, std, unit })
}

fn unit_of_gap(linear: bool) -> &'static str {
    if linear { "m/s" } else { "rad/s" }
}

/// Base parameters and parameters of known effects that moved inside their tolerances.
fn shifts(kept: &Scored) -> Vec<Shift> {
    let covariance = covariance(&kept.hypothesis, &kept.fit, &FINAL);
    let slots = kept.hypothesis.slots.iter().enumerate();
    slots
        .filter_map(|(k, slot)| match slot {
            crate::gap::hypothesis::Slot::Base { key, tolerance, .. } => Some(Shift {
                parameter: (*key).to_owned(),
                shift_percent: 100.0 * ((tolerance * kept.fit.x[k]).exp() - 1.0),
                std_percent: 100.0 * tolerance * covariance[(k, k)].max(0.0).sqrt().min(1.0),
                refitted: kept.hypothesis.model.fitted_to_log,
            }),
            crate::gap::hypothesis::Slot::Known {
                known,
                parameter,
                std,
            } => {
                let known = &kept.hypothesis.model.known[*known];
                let (value, spec) = (known.values[*parameter], &known.effect.parameters[*parameter]);
                (value != 0.0).then(|| Shift {
                    parameter: format!("known.{}.{}", known.effect.name, spec.name),
                    shift_percent: 100.0 * std * kept.fit.x[k] / value,
                    std_percent: 100.0 * (std / value).abs() * covariance[(k, k)].max(0.0).sqrt().min(1.0),
                    refitted: false,
                })
            }
            _ => None,
        })
        .collect()
}
