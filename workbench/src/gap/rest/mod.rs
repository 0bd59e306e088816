//! What is left when all names are given: what it depends on, and a term without a name that describes it.

mod candidates;
mod picture;
mod refit;
mod regress;
mod track;
mod words;

use crate::gap::hypothesis::Hypothesis;
use crate::gap::prediction::held_out_errors;
use crate::gap::search::Scored;
use crate::gap::verdict::Judged;
use crate::outcome::{Experiment, Plot, UnnamedTerm};
use crate::system::model::{Kind, Model};
use crate::system::plant::physics::Drive;
use crate::system::plant::unnamed::{Acting, Term, Variable};
use candidates::told;
use rayon::prelude::*;
use regress::{Dependence, Rest};
use track::Tracks;

pub use refit::Fitted;
pub use words::{name, repeat, unit};

/// A dependence is told from this share of the rest on, in the other fold and in every held-out record.
const TOLD: f64 = 0.1;
/// A simpler table is preferred to one that predicts so much more of the rest.
const MARGIN: f64 = 0.05;
/// The same as a part of what it predicts.
const MARGIN_RELATIVE: f64 = 0.1;
/// Tables that are fitted in free run until one of them lowers every held-out gap.
const TRIED: usize = 3;
/// A term lowers the squared held-out gap to this part, all records together.
const WORTH: f64 = 0.95;

/// What the rest depends on.
#[derive(Clone, Debug)]
pub struct Described {
    /// The variables.
    pub over: Vec<Variable>,
    /// The share of the held-out rest that they predict, of the record for which it is smallest.
    pub share: f64,
    /// A picture of it.
    pub plot: Plot,
    /// What to measure next.
    pub next: Experiment,
    /// The model with a term for it; `None` where no table lowers the gap of every held-out record.
    pub fitted: Option<Fitted>,
}

impl Described {
    /// In words.
    pub fn text(&self) -> String {
        words::sentence(&self.over, self.share)
    }
}

/// Looks for what the rest of a set depends on. `given`: squared held-out gaps of the model as given, which no term may exceed.
pub fn described(scored: &Scored, given: &[f64]) -> Option<Described> {
    let hypothesis = &scored.hypothesis;
    let plant = hypothesis.plant(&scored.fit.x);
    let standstill = candidates::standstill(hypothesis.dataset);
    let (tracks, compared) = Tracks::of(hypothesis, &scored.fit.x, &plant, standstill);
    let rest = Rest::new(scored, &tracks, &compared);
    let there: Vec<Vec<Variable>> = hypothesis.model.unnamed.iter().map(|it| told(&it.term)).collect();
    let all = candidates::all(hypothesis.dataset, &plant, &tracks, acting(hypothesis.model, plant.drive));
    let new = all.iter().filter(|it| !there.contains(&it.told()));
    let mut found: Vec<Dependence> =
        new.collect::<Vec<_>>().par_iter().filter_map(|candidate| rest.tried(candidate)).collect();
    found.retain(|it| it.score() > TOLD);
    let ranked = ranked(found);
    let best = ranked.first()?;
    let mut fits = (0..ranked.len().min(TRIED)).map(|k| (k, refit::fitted(scored, &ranked[k])));
    let kept = fits.find(|(_, fitted)| improves(scored, fitted, given));
    let chosen = kept.as_ref().map_or(best, |(k, _)| &ranked[*k]);
    let term: &Term = kept.as_ref().map_or(&chosen.candidate.term, |(_, fitted)| &fitted.term);
    let over = chosen.candidate.told();
    Some(Described {
        share: chosen.held_out,
        plot: picture::of(scored, &tracks, &compared, term),
        next: words::experiment(&over, hypothesis.dataset),
        over,
        fitted: kept.map(|(_, fitted)| fitted),
    })
}

/// How a structure begins that stays true beside a dependence: a line in time, a place, runs that differ.
const STAYS: [&str; 4] = ["periodic in", "goes with the turn", "a friction that goes", "not repeatable"];
/// What is left where nothing predicts it.
const NOISE: &str = "noise-like: nothing in the motion predicts it on held-out data";

/// Says in a judgement what was found.
pub fn tell(described: Option<&Described>, judged: &mut Judged) {
    let left = &mut judged.unexplained;
    let stays = STAYS.iter().any(|begin| left.structure.starts_with(begin));
    let differs = left.structure.starts_with(STAYS[3]);
    left.noise_like = Some(differs || (described.is_none() && !stays));
    let Some(found) = described else {
        if left.structure.starts_with("a function of") || left.structure.starts_with("noise-like") {
            left.structure = NOISE.into();
            judged.next.get_or_insert_with(|| words::repeat(judged.kept.hypothesis.dataset));
        }
        return;
    };
    left.structure = if stays { format!("{}; {}", found.text(), left.structure) } else { found.text() };
    left.depends_on = found.over.iter().map(|variable| variable.key()).collect();
    left.predicts_share = Some(found.share);
    judged.next.get_or_insert_with(|| found.next.clone());
}

/// On what the table of a term acts: a model that does not know torques counts in the unit of its input.
fn acting(model: &Model, drive: Drive) -> Acting {
    match (model.kind, drive) {
        (Kind::FirstOrder { .. } | Kind::Inertia { .. }, _) => Acting::Input,
        (Kind::DcMotor { .. }, _) => Acting::Torque,
    }
}

/// The best first; a simpler or an earlier one stands before those that are better by a margin alone.
fn ranked(mut found: Vec<Dependence>) -> Vec<Dependence> {
    let mut ranked = Vec::new();
    while !found.is_empty() {
        let best = found.iter().map(Dependence::score).fold(0.0, f64::max);
        let close = best - (MARGIN + MARGIN_RELATIVE * best);
        let near = |it: &Dependence| it.score() >= close;
        let simple = found.iter().position(|it| near(it) && it.candidate.simple);
        let first = |simple: bool| {
            let same = found.iter().enumerate().filter(|(_, it)| it.candidate.simple == simple);
            same.max_by(|a, b| a.1.score().total_cmp(&b.1.score())).map(|(k, _)| k)
        };
        let next = if simple.is_some() { first(true) } else { first(false) };
        ranked.push(found.remove(next.unwrap_or(0)));
    }
    ranked
}

/// True if a term lowers the gap of every held-out record, below what the model as given leaves, too.
fn improves(scored: &Scored, fitted: &Fitted, given: &[f64]) -> bool {
    let without = held_out_errors(&scored.hypothesis, &scored.fit.x);
    let with = fitted.held_out(scored);
    let every = with.iter().zip(&without).zip(given).all(|((with, without), given)| with < without && with <= given);
    every && with.iter().sum::<f64>() < WORTH * without.iter().sum::<f64>()
}

/// The set with the term, as a fitted hypothesis of the extended model.
pub fn extended<'a>(scored: &Scored<'a>, fitted: &'a Fitted) -> Scored<'a> {
    let items = scored.hypothesis.items.clone();
    let hypothesis = Hypothesis::new(scored.hypothesis.dataset, &fitted.model, items);
    Scored { hypothesis, fit: fitted.fit.clone(), score: fitted.fit.cost }
}

/// The term as a report tells it; `gaps`: of the held-out data without and with it.
pub fn as_told(scored: &Scored, fitted: &Fitted, gaps: (f64, f64)) -> UnnamedTerm {
    let (dataset, term) = (scored.hypothesis.dataset, &fitted.term);
    let unit = match (term.acts, dataset.linear) {
        (Acting::Torque, false) => "N m",
        (Acting::Torque, true) => "N",
        (Acting::Input, _) => dataset.input.unit(),
        (Acting::Reading, _) => "1",
    };
    let unit_of = |variable| words::unit(variable, dataset.linear, dataset.input.unit());
    UnnamedTerm {
        name: fitted.model.unnamed.last().map_or(String::new(), |it| it.name.clone()),
        over: term.over.iter().map(|knots| knots.variable.key()).collect(),
        knots: term.over.iter().map(|knots| knots.at.clone()).collect(),
        knot_units: term.over.iter().map(|knots| unit_of(knots.variable)).collect(),
        acts: term.acts.key(),
        values: term.values.clone(),
        values_std: fitted.stds.iter().map(|std| Some(*std).filter(|std| std.is_finite())).collect(),
        unit: unit.into(),
        standstill_speed: term.standstill,
        gap_before: gaps.0,
        gap_after: gaps.1,
    }
}
