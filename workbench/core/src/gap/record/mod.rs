//! A record over time against a model: prepare → simulate → localise → search → judge → extend.

mod estimate;
mod excitation;
mod extend;
mod sentences;
mod sides;
mod verdict;

use crate::gap::acceptance::prediction::Prediction;
use crate::gap::dataset::{self, Dataset, FullPass, Part, hf_noise, prepare};
use crate::gap::fit::SEARCH;
use crate::gap::fit::hypothesis::Slot;
use crate::gap::fit::samples::{Sample, samples};
use crate::gap::options::{Options, ShareLimits};
use crate::gap::record::extend::{Given, Last, extended};
use crate::gap::record::verdict::Judged;
use crate::gap::remainder::look::{sensor_like, twin_pairs};
use crate::gap::remainder::structure::Structure;
use crate::gap::remainder::{self, Described, Scope, places};
use crate::gap::residual::rms;
use crate::gap::search::{Found, Progress, Scored, base_fit, chi2, search};
use crate::outcome::{Outcome, Verdict};
use crate::system::log::Dynamic;
use crate::system::model::Model;
use crate::system::plant::physics::Physics;
use crate::system::threads::join;
use crate::text::input_error::InputError;
use std::borrow::Borrow;

/// Finds where model and record disagree, names what is missing and predicts the held-out data with it. Where nothing explains the log
/// and the model turns out to be a fit to it, it is read as one.
pub fn run(
    model: &Model,
    log: &Dynamic,
    holdouts: &[&Dynamic],
    options: &Options,
    progress: Progress,
) -> Result<Outcome, InputError> {
    let outcome = searched(model, log, holdouts, options, progress)?;
    let fitted = Model { fitted_to_log: true, ..model.clone() };
    let as_told = model.fitted_to_log || outcome.verdict != Verdict::Unexplained;
    if as_told || !is_a_fit(&made_ready(&fitted, log, holdouts)?, &fitted) {
        return Ok(outcome);
    }
    let mut outcome = searched(&fitted, log, holdouts, options, progress)?;
    outcome.notes.push(A_FIT.into());
    Ok(outcome)
}

/// Said of a model whose numbers the log moves nowhere.
const A_FIT: &str = "No numbers of the model fit this log better than those that it has: it is a fit to the log, and names are judged as for \
                     one. Write fitted_to_log = true in its [model]";
/// The numbers of a fit are moved by less than this part when they are fitted again: another integrator and another
/// start of a run do that. Origin: in 60 drawn logs with an effect outside of the library at least one number of a
/// data sheet moved by 6 % and more, and of 17 fitted rigs none by more than 3.3 %.
const MOVES: f64 = 0.035;
/// And they lower the squared error by less than this part. Origin: 4.5 % of it on one of those rigs, below 2 % on
/// the others.
const LOWERS: f64 = 0.05;

/// True if the numbers of a model are already the best ones for a log, whatever its file says.
fn is_a_fit(dataset: &Dataset, model: &Model) -> bool {
    let (given, base) = (Scored::given(dataset, model), base_fit(dataset, model));
    let before = chi2(&given.hypothesis, &given.fit.x, &SEARCH).0;
    let mut numbers = base.hypothesis.slots.iter().zip(&base.fit.x);
    let stays = |(slot, x): (&Slot, &f64)| match slot {
        Slot::Base { tolerance, .. } => (tolerance * x).abs() < MOVES,
        _ => true,
    };
    base.fit.chi2 > (1.0 - LOWERS) * before && numbers.all(stays)
}

/// Prepare → search → judge → extend, with a model as it says that it is.
fn searched(
    model: &Model,
    log: &Dynamic,
    holdouts: &[&Dynamic],
    options: &Options,
    progress: Progress,
) -> Result<Outcome, InputError> {
    let dataset = made_ready(model, log, holdouts)?;
    if let Some(outcome) = excitation::not_excited(&dataset) {
        return Ok(outcome);
    }
    let last = only_predicted(model, log, holdouts, &options.finals)?;
    let whole = FullPass::of(model, log, holdouts, &dataset);
    let given = Given::simulated(&dataset, model, whole.as_ref());
    let places = places::places(&given.set.hypothesis, &given.seen);
    // On a thread of the pool, which hands on what it can share without being woken first.
    let searching = || {
        let found = search(&dataset, model, options, progress);
        concluded(&given, &found, &options.limits, last.as_ref())
    };
    Ok(Outcome { places, ..join(searching, || ()).0 })
}

/// What is said of what was found.
fn concluded(given: &Given, found: &Found, limits: &ShareLimits, last: Option<&Last>) -> Outcome {
    let mut judged = verdict::judge(found, &given.set, limits);
    let eased = estimate::eased(&judged.kept);
    if let Some(eased) = &eased {
        (judged.kept, judged.uncertainty) = (estimate::refitted(eased, &judged.kept), None);
    }
    judged.kept.settle();
    let described = remainder_of(given, &mut judged);
    extended(given, found, judged, described.as_ref(), last)
}

/// Looks for what the remainder depends on, and says so.
fn remainder_of(given: &Given, judged: &mut Judged) -> Option<Described> {
    let scope = match (&judged.structure, judged.verdict) {
        _ if judged.kept.fit.samples < verdict::FEW => return None,
        (Structure::None, Verdict::NothingMissing) => Scope::Turns,
        (Structure::None, _) => return None,
        _ => Scope::Everything,
    };
    let described = remainder::described(&judged.kept, &given.set.held_out(), scope);
    if scope == Scope::Everything || described.is_some() {
        judged.depends(described.as_ref());
    }
    described
}

/// The records that are only predicted, made ready.
fn only_predicted<'a>(
    model: &Model,
    log: &'a Dynamic,
    holdouts: &[&Dynamic],
    finals: &'a [Dynamic],
) -> Result<Option<Last<'a>>, InputError> {
    let copies = |last: &&Dynamic| holdouts.iter().any(|held| dataset::same(held, last));
    if let Some(copy) = finals.iter().find(copies) {
        let what = "is one of the held-out records, which had a veto; give --final another record";
        return Err(InputError::file(&copy.source, what));
    }
    if finals.is_empty() {
        return Ok(None);
    }
    let finals: Vec<&Dynamic> = finals.iter().collect();
    let dataset = made_ready(model, log, &finals)?;
    let whole = FullPass::of(model, log, &finals, &dataset);
    Ok(Some(Last { dataset, whole }))
}

/// Log and hold-outs on their grids, with noise and weights.
pub fn made_ready(
    model: &Model,
    log: &Dynamic,
    holdouts: &[impl Borrow<Dynamic>],
) -> Result<Dataset, InputError> {
    let dataset = prepare(model, log, holdouts)?;
    let (plant, sigma) = (Scored::given(&dataset, model).plant(), dataset.sigma);
    let rough = dataset.weighed(&plant, sigma);
    let (plant, sigma) = settled(&rough, model);
    let dataset = rough.weighed(&plant, sigma);
    Ok(if model.fitted_to_log { dataset.evenly_weighed() } else { dataset })
}

/// The base's fit, and the noise from its residual, in which the motion no longer hides it.
fn settled(dataset: &Dataset, model: &Model) -> (Physics, f64) {
    let base = base_fit(dataset, model);
    let fitted = Prediction::of(&base.hypothesis, &base.fit.x, &[Part::A, Part::B]);
    // The first estimate saw the motion too, so this one is lower; 5 % are its own scatter. Chosen by judgement; not studied.
    let high =
        hf_noise(&fitted.residual(), dataset.noise_lag).clamp(0.5 * dataset.sigma, 1.05 * dataset.sigma);
    (base.plant(), repeated_noise(&base).map_or(high, |sigma| sigma.max(high)))
}

/// The noise from the difference of two runs with the same input: it needs no model of the noise.
fn repeated_noise(base: &Scored) -> Option<f64> {
    let seen = samples(base, &[Part::A, Part::B]);
    let pairs = twin_pairs(&seen, base.hypothesis.dataset, Sample::residual);
    let differences: Vec<f64> = pairs.into_iter().map(|(a, b)| a - b).collect();
    sensor_like(&differences).then(|| rms(&differences) / 2f64.sqrt())
}
