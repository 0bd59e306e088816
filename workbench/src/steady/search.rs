//! Which set of effects explains a table: a beam over sets, then backward elimination.
//!
//! The score of a set is n·ln(mean square) + Σ(δ/tolerance)² + k·ln n (Schwarz, Annals of Statistics 6, 1978, with the
//! noise unknown). A beam keeps sets that do not help yet, because some effects help only together. An effect stays only
//! if dropping it costs more than [`THRESHOLD`], widened where neighbouring residuals are alike, and if it is material.

use super::candidates::{Form, Offer, forms, same_place};
use super::fit::{Fit, Problem};
use crate::effects::Effect;
use rayon::prelude::*;

/// Score that an effect has to earn. The evidence of 2 in the log-likelihood that Kass and Raftery (J. Am. Stat. Assoc.
/// 90, 1995) call very strong is 10; with a dozen candidates the chance of one false name stays below 1 %.
pub const THRESHOLD: f64 = 12.0;
/// Sets within this score of the best explain a table as well.
pub const TIE: f64 = 10.0;
/// Sets kept at each depth.
const BEAM: usize = 10;
/// Effects at most.
const DEPTH: usize = 5;
/// Starts that are worth a descent.
const DESCENTS: usize = 4;
/// The mean square has to fall by this factor, or the effect is not worth a name.
const MATERIAL: f64 = 1.15;
/// … and its part of the residual has to be larger than this share of the largest reading: the error budget of a map.
const VISIBLE: f64 = 3e-4;

/// The search for one table.
pub struct Search<'a> {
    /// What is fitted.
    pub problem: &'a Problem<'a>,
    /// Candidates.
    pub offer: &'a Offer,
}

impl Search<'_> {
    /// The score of a fit; the lower the better.
    pub fn score(&self, fit: &Fit) -> f64 {
        let n = self.problem.data.rows() as f64;
        let floor = self.problem.data.resolution.powi(2);
        n * (fit.mean_square + floor).ln() + fit.prior + fit.size() as f64 * n.ln()
    }

    /// The model as given, its base refitted within tolerance.
    pub fn nothing(&self) -> Option<Fit> {
        self.problem.best(&[], &[vec![0.0; self.problem.nuisances.len()]])
    }

    /// The set that explains the fitted rows.
    pub fn run(&self) -> Option<Fit> {
        let best = self.eliminate(self.beam()?);
        Some(self.refine(best))
    }

    /// Adds refinements while one earns its place, then drops what they made superfluous.
    fn refine(&self, mut fit: Fit) -> Fit {
        while let Some(larger) = self.best_refinement(&fit) {
            fit = self.eliminate(larger);
        }
        fit
    }

    fn best_refinement(&self, fit: &Fit) -> Option<Fit> {
        let offered = self.offer.refinements();
        let allowed = offered.iter().filter(|f| self.compatible(fit, f.effect));
        let larger = allowed.filter_map(|form| self.extended(fit, form));
        let earning = larger.filter(|l| self.earns(l, fit, self.inflation(l)));
        earning.min_by(|a, b| self.score(a).total_cmp(&self.score(b)))
    }

    fn beam(&self) -> Option<Fit> {
        let mut best = self.nothing()?;
        let mut beam = vec![best.clone()];
        let mut idle = 0;
        for _ in 0..DEPTH {
            beam = self.expand(&beam);
            let Some(front) = beam.first() else { break };
            idle = if self.score(front) < self.score(&best) - 2.0 {
                0
            } else {
                idle + 1
            };
            if self.score(front) < self.score(&best) {
                best = front.clone();
            }
            // One depth without gain may be a pair in the making; two are the end.
            if idle == 2 {
                break;
            }
        }
        Some(best)
    }

    fn expand(&self, beam: &[Fit]) -> Vec<Fit> {
        let candidates = self.offer.forms();
        let mut jobs: Vec<(&Fit, &Form)> = beam
            .iter()
            .flat_map(|p| candidates.iter().map(move |c| (p, c)))
            .collect();
        jobs.retain(|(parent, form)| self.compatible(parent, form.effect));
        let mut fits: Vec<Fit> = jobs
            .par_iter()
            .filter_map(|(parent, form)| self.extended(parent, form))
            .collect();
        fits.sort_by(|a, b| self.score(a).total_cmp(&self.score(b)));
        let mut seen = std::collections::BTreeSet::new();
        fits.retain(|f| seen.insert(identity(f)));
        fits.truncate(BEAM);
        fits
    }

    /// Whether an effect may be added to a set.
    pub fn compatible(&self, parent: &Fit, effect: &Effect) -> bool {
        !parent
            .forms
            .iter()
            .any(|f| same_place(f.effect, effect) || excludes(f.effect, effect))
    }

    /// The set with one more effect, refitted.
    pub fn extended(&self, parent: &Fit, form: &Form) -> Option<Fit> {
        let (own, shifts) = parent.x.split_at(parent.size());
        let mut all = parent.forms.clone();
        all.push(form.clone());
        let zeros = vec![0.0; shifts.len()];
        let mut starts = Vec::new();
        for start in self.offer.natural.starts(form) {
            for base in [shifts, &zeros] {
                starts.push([own, &start, base].concat());
            }
        }
        self.fit(&all, starts)
    }

    /// Fits a set from the most promising of these starts.
    pub fn fit(&self, all: &[Form], mut starts: Vec<Vec<f64>>) -> Option<Fit> {
        if starts.len() > DESCENTS {
            let promise = |x: &Vec<f64>| self.problem.promise(all, x);
            starts.sort_by_cached_key(|x| ordered(promise(x)));
            starts.truncate(DESCENTS);
        }
        self.problem.best(all, &starts)
    }

    /// Drops what does not earn its place and simplifies what can be simpler, the least missed first.
    fn eliminate(&self, mut fit: Fit) -> Fit {
        while let Some(simpler) = self.least_missed(&fit) {
            fit = simpler;
        }
        fit
    }

    fn least_missed(&self, fit: &Fit) -> Option<Fit> {
        let inflation = self.inflation(fit);
        let reduced = (0..fit.forms.len()).flat_map(|k| self.reductions(fit, k));
        let affordable = reduced.filter(|r| !self.earns(fit, r, inflation));
        affordable.min_by(|a, b| self.score(a).total_cmp(&self.score(b)))
    }

    /// Whether the larger set earns its place beside the smaller one.
    pub fn earns(&self, larger: &Fit, smaller: &Fit, inflation: f64) -> bool {
        let floor = self.problem.data.resolution.powi(2);
        let largest = self
            .problem
            .data
            .omega
            .iter()
            .fold(0.0_f64, |m, w| m.max(w.abs()));
        let (before, after) = (smaller.mean_square + floor, larger.mean_square + floor);
        self.score(smaller) - self.score(larger) > THRESHOLD * inflation
            && before > MATERIAL * after
            && (before - after).sqrt() > VISIBLE * largest
    }

    /// Effect k dropped, or in its simpler form.
    fn reductions(&self, fit: &Fit, k: usize) -> Vec<Fit> {
        let mut reduced = vec![self.without(fit, k)];
        for simpler in simpler(&fit.forms[k]) {
            reduced.push(self.substituted(fit, k, &simpler));
        }
        reduced.into_iter().flatten().collect()
    }

    /// The set without effect k, refitted.
    pub fn without(&self, fit: &Fit, k: usize) -> Option<Fit> {
        let kept = |j: &usize| *j != k;
        let all: Vec<Form> = (0..fit.forms.len())
            .filter(kept)
            .map(|j| fit.forms[j].clone())
            .collect();
        let own: Vec<f64> = (0..fit.forms.len())
            .filter(kept)
            .flat_map(|j| fitted_values(fit, j))
            .collect();
        let zeros = vec![0.0; fit.shifts().len()];
        self.fit(
            &all,
            vec![[&own, fit.shifts()].concat(), [&own, &zeros[..]].concat()],
        )
    }

    /// The set with another form in the place of effect k, refitted.
    pub fn substituted(&self, fit: &Fit, k: usize, form: &Form) -> Option<Fit> {
        let others = self.others(fit, k);
        if !self.compatible(&others, form.effect) {
            return None;
        }
        self.extended(&others, form)
    }

    /// The set without effect k, not refitted.
    pub fn others(&self, fit: &Fit, k: usize) -> Fit {
        let rest: Vec<usize> = (0..fit.forms.len()).filter(|j| *j != k).collect();
        let own: Vec<f64> = rest.iter().flat_map(|j| fitted_values(fit, *j)).collect();
        let forms = rest.iter().map(|j| fit.forms[*j].clone()).collect();
        Fit {
            forms,
            x: [&own, fit.shifts()].concat(),
            ..fit.clone()
        }
    }

    /// How much less independent the residuals are than their number says: (1 + ρ)/(1 − ρ), ρ between neighbours.
    pub fn inflation(&self, fit: &Fit) -> f64 {
        let predicted = self.problem.predict(fit);
        let data = self.problem.data;
        let rows = data.omega.iter().zip(&predicted).zip(&data.fitted);
        let residual: Vec<f64> = rows.filter(|(_, f)| **f).map(|((y, p), _)| y - p).collect();
        let power: f64 = residual.iter().map(|r| r * r).sum();
        let pairs: f64 = residual.windows(2).map(|w| w[0] * w[1]).sum();
        let correlation = (pairs / power.max(f64::MIN_POSITIVE)).clamp(0.0, 0.8);
        // Independent residuals of n rows correlate by ±1/√n; only what exceeds that counts.
        let chance = 1.0 / (residual.len() as f64).sqrt();
        let correlation = (correlation - chance).max(0.0);
        (1.0 + correlation) / (1.0 - correlation)
    }
}

/// Fitted parameters of effect k.
fn fitted_values(fit: &Fit, k: usize) -> Vec<f64> {
    let start: usize = fit.forms[..k].iter().map(Form::size).sum();
    fit.x[start..start + fit.forms[k].size()].to_vec()
}

/// Simpler forms of the same thing: optional parameters at their defaults, one width for both directions.
fn simpler(form: &Form) -> Vec<Form> {
    let mut simpler: Vec<Form> = forms(form.effect)
        .into_iter()
        .filter(|f| f.size() < form.size())
        .collect();
    let symmetric = match form.effect.name {
        "dead_zone_asymmetric" => crate::effects::find("dead_zone"),
        "coulomb_asymmetric" => crate::effects::find("coulomb_friction"),
        _ => None,
    };
    simpler.extend(
        symmetric
            .into_iter()
            .flat_map(forms)
            .filter(|f| f.size() < form.size()),
    );
    simpler
}

/// Pairs that are one thing in a steady state and must not stand side by side.
fn excludes(a: &Effect, b: &Effect) -> bool {
    const SAME: [&[&str]; 4] = [
        &["drive_gain", "encoder_scale"],
        &[
            "dead_zone",
            "dead_zone_asymmetric",
            "coulomb_friction",
            "coulomb_asymmetric",
            "voltage_drop",
        ],
        &["voltage_saturation", "speed_saturation", "current_limit"],
        &["quadratic_drag", "supply_sag"],
    ];
    SAME.iter()
        .any(|group| group.contains(&a.name) && group.contains(&b.name))
}

/// What a set is: names and how many parameters are free.
fn identity(fit: &Fit) -> Vec<(&'static str, usize)> {
    let mut key: Vec<_> = fit.forms.iter().map(|f| (f.effect.name, f.size())).collect();
    key.sort_unstable();
    key
}

/// An order for finite costs; what is not finite comes last.
fn ordered(cost: f64) -> u64 {
    let cost = if cost.is_finite() { cost } else { f64::MAX };
    let bits = cost.to_bits();
    if cost.is_sign_negative() {
        !bits
    } else {
        bits | (1 << 63)
    }
}
