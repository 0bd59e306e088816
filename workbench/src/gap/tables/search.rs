//! Which set of effects explains a table: a beam over sets, then backward elimination.
//!
//! The score of a set is n·ln(mean square) + Σ(δ/tolerance)² + k·ln n (Schwarz, Annals of Statistics 6, 1978, with the
//! noise unknown). A beam keeps sets that do not help yet, because some effects help only together. An effect stays only
//! if dropping it costs more than [`THRESHOLD`], widened where neighbouring residuals are alike, and if it is material.

use super::candidates::{Form, Offer, forms, same_place};
use super::fit::{Fit, Problem};
use crate::system::effects::{Effect, Family, Forms, LIBRARY, Scale};
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
        Some(self.united(self.refine(best)))
    }

    /// One width and an offset are two widths under other names, exactly; so are friction and a constant torque. Such a
    /// pair becomes the one effect that it is.
    fn united(&self, fit: Fit) -> Fit {
        let Some((even, constant, uneven)) = even_and_constant(&fit) else {
            return fit;
        };
        let without = self.others(&fit, even.max(constant));
        let others = self.others(&without, even.min(constant));
        let united = forms(uneven)
            .into_iter()
            .filter_map(|form| self.extended(&others, &form));
        let best = united.min_by(|a, b| self.score(a).total_cmp(&self.score(b)));
        best.filter(|best| self.score(best) < self.score(&fit) + 1.0)
            .unwrap_or(fit)
    }

    /// Adds refinements while one earns its place, then drops what they made superfluous.
    fn refine(&self, mut fit: Fit) -> Fit {
        while let Some(larger) = self.best_refinement(&fit) {
            fit = self.eliminate(larger);
        }
        fit
    }

    fn best_refinement(&self, fit: &Fit) -> Option<Fit> {
        let mut offered = self.offer.refinements();
        offered.retain(|f| self.compatible(fit, f.effect));
        let larger = offered.par_iter().filter_map(|form| self.refined(fit, form));
        let mut earning: Vec<Fit> = larger.filter(|l| self.earns(l, fit, self.inflation(l))).collect();
        earning.sort_by(|a, b| self.score(a).total_cmp(&self.score(b)));
        earning.into_iter().next()
    }

    fn refined(&self, fit: &Fit, form: &Form) -> Option<Fit> {
        match form.effect.steady().map(|steady| steady.forms) {
            Some(Forms::FromRest(_)) => self.with_breakaway(fit, form),
            _ => self.extended(fit, form),
        }
    }

    /// A set with breakaway friction. Without it the dead zone was drawn towards the voltage at which the motor starts, and
    /// no gradient leads back, because zone and breakaway have to move together: the starts narrow the zone step by step
    /// and put the breakaway where the table shows the motor starting.
    fn with_breakaway(&self, fit: &Fit, form: &Form) -> Option<Fit> {
        let (own, shifts) = fit.x.split_at(fit.size());
        let mut all = fit.forms.clone();
        all.push(form.clone());
        let mut starts = Vec::new();
        for narrowed in narrowed(fit, own) {
            let plant = self.problem.plant(&fit.forms, &[&narrowed, shifts].concat());
            for volts in self.offer.restarts() {
                let level = 0.999 * plant.applied(*volts).abs() * plant.torque_per_input();
                let slow = 0.02 * self.offer.natural.unit(Scale::Speed);
                starts.push([&narrowed[..], &[level, slow], shifts].concat());
            }
        }
        let fits: Vec<Fit> = starts
            .par_iter()
            .filter_map(|s| self.problem.best(&all, std::slice::from_ref(s)))
            .collect();
        fits.into_iter()
            .min_by(|a, b| self.score(a).total_cmp(&self.score(b)))
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
            .any(|f| same_place(f.effect, effect) || f.effect.excludes_in_tables(effect))
    }

    /// The set with one more effect, refitted.
    pub fn extended(&self, parent: &Fit, form: &Form) -> Option<Fit> {
        let (own, shifts) = parent.x.split_at(parent.size());
        let mut all = parent.forms.clone();
        all.push(form.clone());
        let zeros = vec![0.0; shifts.len()];
        let mut starts = Vec::new();
        let natural = self
            .offer
            .natural
            .of_plant(&self.problem.plant(&parent.forms, &parent.x));
        for start in natural.starts(form) {
            for base in [shifts, &zeros] {
                starts.push([own, &start, base].concat());
            }
        }
        self.fit(&all, starts)
    }

    /// Fits a set from the most promising of these starts.
    pub fn fit(&self, all: &[Form], mut starts: Vec<Vec<f64>>) -> Option<Fit> {
        if starts.len() > DESCENTS {
            let mut promising: Vec<(f64, Vec<f64>)> = starts
                .into_iter()
                .map(|x| (self.problem.promise(all, &x), x))
                .collect();
            promising.sort_by(|a, b| a.0.total_cmp(&b.0));
            starts = promising.into_iter().take(DESCENTS).map(|p| p.1).collect();
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

/// The fitted parameters with each width of the dead zone narrowed in steps, one side at a time and both together.
fn narrowed(fit: &Fit, own: &[f64]) -> Vec<Vec<f64>> {
    let zone = |f: &Form| f.effect.family == Family::DeadZone;
    let Some(k) = fit.forms.iter().position(zone) else {
        return vec![own.to_vec()];
    };
    let first: usize = fit.forms[..k].iter().map(Form::size).sum();
    let widths = fit.forms[k].effect.parameters.iter();
    let sides = widths.filter(|width| width.default.is_none()).count();
    let mut all = vec![own.to_vec()];
    for share in [0.95, 0.9, 0.85, 0.8, 0.7, 0.6] {
        for which in 1..1 << sides {
            let mut x = own.to_vec();
            (0..sides)
                .filter(|side| which >> side & 1 == 1)
                .for_each(|side| x[first + side] *= share);
            all.push(x);
        }
    }
    all
}

/// Simpler forms of the same thing: optional parameters at their defaults, one width for both directions.
fn simpler(form: &Form) -> Vec<Form> {
    let mut simpler: Vec<Form> = forms(form.effect)
        .into_iter()
        .filter(|f| f.size() < form.size())
        .collect();
    let even = form.effect.relations.uneven_of.map(|uneven| uneven.even);
    let even = even.into_iter().flat_map(forms);
    simpler.extend(even.filter(|f| f.size() < form.size()));
    simpler
}

/// The places of an even effect and of a constant in a set, and the uneven effect that the two make together.
fn even_and_constant(fit: &Fit) -> Option<(usize, usize, &'static Effect)> {
    let place = |effect: &Effect| fit.forms.iter().position(|form| form.effect == effect);
    LIBRARY.iter().find_map(|effect| {
        let uneven = effect.relations.uneven_of?;
        let constant = uneven.with.iter().find_map(|constant| place(constant))?;
        Some((place(uneven.even)?, constant, *effect))
    })
}

/// What a set is: names and how many parameters are free.
fn identity(fit: &Fit) -> Vec<(&'static str, usize)> {
    let mut key: Vec<_> = fit.forms.iter().map(|f| (f.effect.name, f.size())).collect();
    key.sort_unstable();
    key
}
