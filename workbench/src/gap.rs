//! The gap workflow in plain words: log → simulate → residual → localise → name → extend.

use crate::bench::{Bench, Part, hf_noise, prepare};
use crate::effects::Starts;
use crate::fit::{FINAL, SEARCH, Setting, covariance};
use crate::hypothesis::Hypothesis;
use crate::input_error::InputError;
use crate::log::Dynamic;
use crate::model::Model;
use crate::outcome::*;
use crate::prediction::Prediction;
use crate::residual::{fit_percent, rms};
use crate::search::{Found, Progress, Scored, base_fit, dispersion, scatter, search};
use crate::structure::{sensor_like, twin_pairs};
use crate::view::samples;
use crate::{effects, evidence, excitation, localise, plots, verdict, volts};
use std::collections::BTreeMap;
use std::time::Instant;

/// A set that leaves this much (χ² a sample) is wrong by several times the noise: its numbers are fitted anew with its own
/// error in the weights.
const BEYOND_NOISE: f64 = 4.0;

/// What the user may choose.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Effects that are not offered.
    pub without: Vec<String>,
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
    let found = search(&bench, model, &options.without, progress);
    let mut outcome = concluded(&bench, model, &found);
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
fn concluded(bench: &Bench, model: &Model, found: &Found) -> Outcome {
    let given = Hypothesis::new(bench, model, Vec::new());
    let nominal = vec![0.0; given.slots.len()];
    let before = Prediction::of(&given, &nominal, &[Part::HoldOut]);
    let mut judged = verdict::judge(found, &given, &nominal);
    let eased = eased(&judged.kept);
    if let Some(eased) = &eased {
        judged.kept = refitted(eased, &judged.kept);
    }
    let steps = steps(&judged.kept, before.gap());
    let after = Prediction::of(&judged.kept.hypothesis, &judged.kept.fit.x, &[Part::HoldOut]);
    let effects = volts::told(model, named(&judged.kept, &steps, &judged.ties));
    Outcome {
        schema: "truing-gap/1",
        verdict: judged.verdict,
        effects,
        closest_known: judged.closest.clone(),
        holdout: HoldOut {
            signal: bench.signal.to_owned(),
            rmse_before: before.gap(),
            rmse_after: after.gap(),
            noise_floor: bench.sigma,
            fit_percent_before: fit_percent(&before.measured, &before.predicted),
            fit_percent_after: fit_percent(&after.measured, &after.predicted),
        },
        within_tolerance: shifts(&judged.kept),
        places: localise::places(&given, &nominal),
        unexplained: judged.unexplained.clone(),
        next_experiment: judged.next.clone(),
        runtime_s: 0.0,
        notes: [bench.notes.clone(), excitation::missing(bench)].concat(),
        rivals: evidence::rivals(found, &judged.ties),
        plots: plots::all(&given, &nominal, &judged.kept),
        ties: judged.ties,
        steps,
        gap_unit: unit_of_gap(bench.linear).into(),
    }
}

/// A bench whose weights hold the error of a set that leaves several times the noise.
fn eased(kept: &Scored) -> Option<Bench> {
    let hypothesis = &kept.hypothesis;
    let coarse = kept.fit.chi2 > BEYOND_NOISE * kept.fit.samples as f64;
    let start = |run: usize| hypothesis.start_speed(run, &kept.fit.x);
    coarse.then(|| hypothesis.bench.eased(&hypothesis.plant(&kept.fit.x), start))
}

/// The same set, fitted with the weights of another bench.
fn refitted<'a>(bench: &'a Bench, kept: &Scored<'a>) -> Scored<'a> {
    let hypothesis = Hypothesis::new(bench, kept.hypothesis.model, kept.hypothesis.items.clone());
    let setting = Setting {
        iterations: SEARCH.iterations,
        ..FINAL
    };
    let fit = crate::fit::fit(&hypothesis, &kept.fit.x, &setting);
    Scored {
        score: fit.cost,
        hypothesis,
        fit,
    }
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
            crate::fit::fit(&hypothesis, &start, &FINAL).x
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
    let covariance = covariance(&kept.hypothesis, &kept.fit, &FINAL);
    let (factor, scatter) = (dispersion(kept), scatter(kept));
    let linear = kept.hypothesis.bench.linear;
    let effect = |(index, item): (usize, &crate::hypothesis::Item)| {
        let mut parameters = BTreeMap::new();
        for (k, spec) in item.effect.parameters.iter().enumerate() {
            let value = kept.hypothesis.value(index, k, &kept.fit.x);
            let slot = kept.hypothesis.slots.iter().position(|slot| {
                *slot
                    == crate::hypothesis::Slot::Effect {
                        item: index,
                        parameter: k,
                    }
            });
            if slot.is_none() && spec.default.is_some() {
                continue;
            }
            let scale = kept.hypothesis.bench.scales.of(spec.scale);
            let std = slot.map(|s| {
                let variance = (covariance[(s, s)].max(0.0) * factor + scatter[s]) * scale * scale;
                (variance + zero_variance(kept, index, spec.name)).sqrt()
            });
            let (key, unit) = if linear {
                (effects::linear_key(spec.name), effects::linear_unit(spec.unit))
            } else {
                (spec.name.into(), spec.unit.into())
            };
            parameters.insert(key, Value { value, std, unit });
        }
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
            parameters,
            derived: BTreeMap::new(),
        }
    };
    kept.hypothesis.items.iter().enumerate().map(effect).collect()
}

/// Variance of the phase of an effect of the position, because the encoder's zero lies anywhere within a count.
fn zero_variance(kept: &Scored, index: usize, parameter: &str) -> f64 {
    let hypothesis = &kept.hypothesis;
    let effect = hypothesis.items[index].effect;
    let place = effect.parameters.iter().position(|p| p.name == "periods_per_rev");
    let periods = match effect.starts {
        Starts::GravityScan => 1.0 / hypothesis.model.physics().gear_ratio,
        Starts::PositionScan => place.map_or(0.0, |k| hypothesis.value(index, k, &kept.fit.x)),
        _ => 0.0,
    };
    let encoder = hypothesis.model.encoder.filter(|_| parameter == "phase_rad");
    encoder.map_or(0.0, |encoder| {
        (periods * std::f64::consts::TAU / encoder.counts_per_rev).powi(2) / 12.0
    })
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
            crate::hypothesis::Slot::Base { key, tolerance, .. } => Some(Shift {
                parameter: (*key).to_owned(),
                shift_percent: 100.0 * ((tolerance * kept.fit.x[k]).exp() - 1.0),
                std_percent: 100.0 * tolerance * covariance[(k, k)].max(0.0).sqrt().min(1.0),
                refitted: kept.hypothesis.model.fitted_to_log,
            }),
            crate::hypothesis::Slot::Known {
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
