//! What may be said: named, tie, nothing missing, unexplained, not excited.

use crate::bench::Bench;
use crate::gap::ties_of;
use crate::hypothesis::Hypothesis;
use crate::outcome::{Experiment, HoldOut, Outcome, Tie, Unexplained, Verdict};
use crate::search::{Found, Scored};

/// The judgement on a search.
pub struct Judged<'a> {
    /// What holds.
    pub verdict: Verdict,
    /// The set that is reported as named.
    pub kept: Scored<'a>,
    /// Names that only resemble what is missing.
    pub closest: Vec<String>,
    /// Explanations that cannot be told apart.
    pub ties: Vec<Tie>,
    /// What is left.
    pub unexplained: Unexplained,
    /// What to measure next.
    pub next: Option<Experiment>,
}

/// If nothing moves, nothing can be tested.
pub fn not_excited(bench: &Bench) -> Option<Outcome> {
    (bench.scales.speed < 5.0 * bench.sigma).then(|| Outcome {
        schema: "truing-gap/1",
        verdict: Verdict::InsufficientExcitation,
        effects: Vec::new(),
        ties: Vec::new(),
        closest_known: Vec::new(),
        holdout: HoldOut {
            signal: bench.signal.into(),
            rmse_before: 0.0,
            rmse_after: 0.0,
            noise_floor: bench.sigma,
            fit_percent_before: 0.0,
            fit_percent_after: 0.0,
        },
        within_tolerance: Vec::new(),
        places: Vec::new(),
        unexplained: Unexplained {
            share_of_gap: 0.0,
            structure: "none".into(),
        },
        next_experiment: None,
        runtime_s: 0.0,
        notes: bench.notes.clone(),
        steps: Vec::new(),
        rivals: Vec::new(),
        plots: Vec::new(),
        gap_unit: "rad/s".into(),
    })
}

/// Judges what was found.
pub fn judge<'a>(_bench: &Bench, found: &Found<'a>, _given: &Hypothesis, _nominal: &[f64]) -> Judged<'a> {
    let rivals = ties_of(found);
    let samples = found.best.fit.samples as f64;
    let left = (found.best.fit.chi2 - samples).max(0.0) / (found.base.fit.chi2 - samples).max(1.0);
    let mut ties = Vec::new();
    if !rivals.is_empty() {
        let mut sets = vec![found.best.hypothesis.names()];
        sets.extend(rivals.iter().map(|rival| rival.hypothesis.names()));
        ties.push(Tie {
            rivals: sets,
            separated_by: String::new(),
        });
    }
    let verdict = if found.best.hypothesis.items.is_empty() {
        Verdict::NothingMissing
    } else if ties.is_empty() {
        Verdict::Named
    } else {
        Verdict::Tie
    };
    Judged {
        verdict,
        kept: found.best.clone(),
        closest: Vec::new(),
        ties,
        unexplained: Unexplained {
            share_of_gap: left,
            structure: "none".into(),
        },
        next: None,
    }
}
