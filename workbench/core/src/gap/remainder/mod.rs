//! What is left when all names are given: what it depends on, and a term without a name that describes it.

mod candidates;
pub mod look;
mod picture;
pub mod places;
mod refit;
mod regression;
pub mod structure;
mod track;
mod turn;
mod words;

use crate::gap::hypothesis::Hypothesis;
use crate::gap::remainder::structure::Structure;
use crate::gap::search::Scored;
use crate::gap::threads::each;
use crate::gap::verdict::Judged;
use crate::outcome::{Experiment, Plot, UnnamedTerm, Verdict};
use crate::system::model::{Kind, Model};
use crate::system::plant::physics::Drive;
use crate::system::plant::unnamed::{Acting, Term, Variable};
use candidates::{Candidate, told};
use rayon::prelude::*;
use regression::{Dependence, Regression};
use track::{Compared, Tracks};

pub use refit::Fitted;
pub use words::{name, repeat, unit};

/// A dependence is told from this share of the rest on, in the other fold and in every held-out record.
const TOLD: f64 = 0.1;
/// A simpler table is preferred to one that predicts so much more of the rest.
const MARGIN: f64 = 0.05;
/// The same as a part of what it predicts.
const MARGIN_RELATIVE: f64 = 0.1;
/// Tables that are fitted in free run: the best of them is told.
const TRIED: usize = 4;
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
    /// The variables by their keys.
    pub fn keys(&self) -> Vec<&'static str> {
        self.over.iter().map(|variable| variable.key()).collect()
    }
}

/// Looks for what the rest of a set depends on. `given`: squared held-out gaps of the model as given, which no term may exceed.
///
/// The motion that the set simulates may be far from the true one. So the best table is fitted in free run first, and the look is
/// repeated along the motion that the set simulates with it; no look is along a measured motion, which holds the rest itself.
pub fn described(scored: &Scored, given: &[f64], scope: Scope) -> Option<Described> {
    let first = looked(scored, None, scope);
    let fitted = refit::fitted(scored, first.ranked.first()?);
    let second = looked(scored, Some(&fitted), scope);
    let look = if second.ranked.is_empty() { first } else { second };
    // One term a model: what a second table would add is the error of the first one's form.
    let most = if scored.hypothesis.model.unnamed.is_empty() { TRIED } else { 0 };
    let first = &look.ranked[..most.min(look.ranked.len())];
    let mut tried: Vec<Tried> = each(first).map(|dependence| Tried::new(scored, dependence, given)).collect();
    let (candidate, share, fitted) = match chosen(&tried).map(|k| tried.swap_remove(k)) {
        Some(it) => (it.candidate, it.share, Some(it.fitted)),
        None => (look.ranked[0].candidate.clone(), look.ranked[0].held_out, None),
    };
    let term: &Term = fitted.as_ref().map_or(&candidate.term, |fitted| &fitted.term);
    let over = candidate.told();
    Some(Described {
        share,
        plot: picture::of(scored, &look.tracks, &look.compared, term),
        next: words::experiment(&over, scored.hypothesis.dataset),
        over,
        fitted,
    })
}

/// The best of those that improve: a simple table, unless another is better by a margin.
fn chosen(tried: &[Tried]) -> Option<usize> {
    let improving = || tried.iter().enumerate().filter(|(_, it)| it.improves);
    let best = improving().max_by(|a, b| a.1.share.total_cmp(&b.1.share))?;
    let simple = improving().filter(|(_, it)| it.candidate.simple);
    let simple = simple.max_by(|a, b| a.1.share.total_cmp(&b.1.share));
    Some(simple.filter(|(_, it)| near(it.share, best.1.share)).map_or(best.0, |(k, _)| k))
}

/// What is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// Everything, in a rest that is visible beyond the noise.
    Everything,
    /// The place within a turn, in residuals that pass for noise: what ripples from sample to sample is part of the noise that is
    /// estimated from them.
    Turns,
}

/// One look: the dependences that are worth telling, the best first.
struct Look {
    tracks: Tracks,
    compared: Vec<Compared>,
    ranked: Vec<Dependence>,
}

/// Looks along the motion that a set simulates, or the same set with a term.
fn looked(scored: &Scored, with: Option<&Fitted>, scope: Scope) -> Look {
    let hypothesis = &scored.hypothesis;
    let dataset = hypothesis.dataset;
    let plant = hypothesis.plant(&scored.fit.x);
    let standstill = candidates::standstill(dataset);
    let (bare, compared) = Tracks::of(hypothesis, &scored.fit.x, &plant, standstill);
    let tracks = with.map_or(bare, |fitted| {
        let extended = extended(scored, fitted);
        let plant = extended.hypothesis.plant(&fitted.fit.x);
        Tracks::of(&extended.hypothesis, &fitted.fit.x, &plant, standstill).0
    });
    let there: Vec<Variable> = hypothesis.model.unnamed.iter().flat_map(|it| told(&it.term)).collect();
    let mut all = candidates::all(dataset, &plant, &tracks, acting(hypothesis.model, plant.drive));
    all.retain(|it| !it.told().iter().any(|variable| there.contains(variable)));
    if scope == Scope::Turns {
        all.retain(|it| it.simple && it.told()[0].is_periodic());
    }
    let noise = if scope == Scope::Turns { 0.0 } else { dataset.sigma };
    let regression = Regression::new(scored, &tracks, &compared, noise);
    let mut found: Vec<Dependence> = each(&all).filter_map(|candidate| regression.tried(candidate)).collect();
    found.retain(|it| it.score() > TOLD);
    Look { ranked: ranked(found), tracks, compared }
}

/// A dependence whose table was fitted in free run.
struct Tried {
    candidate: Candidate,
    fitted: Fitted,
    /// The share of the held-out rest that the simulation with the term predicts, in the record for which it is smallest.
    share: f64,
    /// True if the term lowers the gap of every held-out record, below what the model as given leaves, too.
    improves: bool,
}

impl Tried {
    fn new(scored: &Scored, dependence: &Dependence, given: &[f64]) -> Self {
        let fitted = refit::fitted(scored, dependence);
        let dataset = scored.hypothesis.dataset;
        let without = scored.held_out();
        let with = fitted.held_out(scored);
        let noise =
            dataset.held_out_samples().into_iter().map(|count| count as f64 * dataset.sigma * dataset.sigma);
        let every = || with.iter().zip(&without);
        let shares = every().zip(noise).map(|((with, without), noise)| {
            let left = (without - noise).max(0.1 * without);
            (without - with) / left
        });
        let share = shares.fold(1.0, f64::min);
        let lower = every().all(|(with, without)| with < without)
            && with.iter().zip(given).all(|(with, given)| with <= given);
        let improves = lower && with.iter().sum::<f64>() < WORTH * without.iter().sum::<f64>();
        Self { candidate: dependence.candidate.clone(), fitted, share, improves }
    }
}

/// Beside a dependence that predicts more than this, a line in time or a trace of the turn is a part of it.
const MOST: f64 = 0.5;

/// Puts what was found into a judgement.
pub fn tell(described: Option<&Described>, judged: &mut Judged) {
    let seen = std::mem::take(&mut judged.structure);
    let differs = matches!(seen, Structure::Unrepeatable { .. });
    judged.noise_like = Some(differs || (described.is_none() && !seen.stays()));
    let Some(found) = described else {
        judged.structure = seen;
        if matches!(judged.structure, Structure::FunctionOf { .. } | Structure::Correlated) {
            judged.structure = Structure::Unpredicted;
            judged.next.get_or_insert_with(|| words::repeat(judged.kept.hypothesis.dataset));
        }
        return;
    };
    if judged.verdict == Verdict::NothingMissing {
        (judged.verdict, judged.share) = (Verdict::Unexplained, found.share);
    }
    let turns = found.over.iter().any(|variable| variable.is_periodic());
    let also = differs || (seen.stays() && (turns || found.share < MOST));
    let beside = also.then(|| Box::new(seen));
    judged.structure = Structure::Predicted { by: words::sentence(&found.over, found.share), beside };
    judged.next.get_or_insert_with(|| found.next.clone());
}

/// On what the table of a term acts: a model that does not know torques counts in the unit of its input.
fn acting(model: &Model, drive: Drive) -> Acting {
    match (model.kind, drive) {
        (Kind::FirstOrder { .. } | Kind::Inertia { .. }, _) => Acting::Input,
        (Kind::DcMotor { .. }, _) => Acting::Torque,
    }
}

/// The best first; a simple one stands before those that are better by a margin alone.
fn ranked(mut found: Vec<Dependence>) -> Vec<Dependence> {
    let mut ranked = Vec::new();
    while !found.is_empty() {
        let best = found.iter().map(Dependence::score).fold(0.0, f64::max);
        let simple = found.iter().any(|it| near(it.score(), best) && it.candidate.simple);
        let same = found.iter().enumerate().filter(|(_, it)| it.candidate.simple == simple);
        let next = same.max_by(|a, b| a.1.score().total_cmp(&b.1.score())).map(|(k, _)| k);
        ranked.push(found.remove(next.unwrap_or(0)));
    }
    ranked
}

/// True if a share is the best within the margin that a simpler table is worth.
fn near(share: f64, best: f64) -> bool {
    share >= best - (MARGIN + MARGIN_RELATIVE * best)
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
