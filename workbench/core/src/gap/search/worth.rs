//! Whether a larger set pays for itself.

use super::Search;
use crate::gap::acceptance::worth;
use crate::gap::dataset::Part;
use crate::gap::fit::{FINAL, SEARCH, Setting, fit};
use crate::gap::hypothesis::{Hypothesis, Item, tolerance};
use crate::gap::initial_guesses::Basis;
use crate::gap::scored::{Scored, chi2, dispersion, dispersion_on};
use crate::gap::threads::each;
use rayon::prelude::*;
use std::sync::OnceLock;

/// Smallest visibility of an effect: the rms change of the prediction over the noise. At a tenth and less nothing can
/// be named reliably (decision 0032). Half of it changes no case, twice it loses one pair (of 26 design
/// cases).
pub(super) const VISIBLE: f64 = 0.13;
/// Smallest visibility of a further effect when the residual is already as small as the noise. Halved or doubled it
/// changes no case (of 26 design cases).
const VISIBLE_IN_NOISE: f64 = 0.22;
/// Smallest visibility of a further effect whose period is searched for. On a repeating trajectory the model error of
/// a large effect is periodic, too; hence a higher threshold. Halved or doubled it changes no case
/// (of 26 design cases).
const VISIBLE_LINE: f64 = 0.25;
/// Smallest share of the remaining squared gap that a further effect must explain (decision 0032). Halved or doubled
/// it changes no case (of 26 design cases).
const SHARE_OF_REST: f64 = 0.05;
/// Smallest share of the first squared gap that a further effect must explain: below it, the imperfect form of a
/// large effect attracts second names (decision 0032). Halved or doubled it changes no case (of 26 design
/// cases).
pub(super) const SHARE_OF_GAP: f64 = 1e-2;
/// A further effect below [`SHARE_OF_GAP`] is still accepted if it explains this share of what is left: a form that
/// is wrong leaves something else, too (decision 0032). Halved or doubled it changes no case (of 26
/// design cases).
const NEARLY_ALL: f64 = 0.8;
/// This share of what is left is enough where nothing but noise remains after it. Half of it changes no case, twice
/// it loses one pair (of 26 design cases).
const MOST: f64 = 0.6;
/// Nothing but noise remains where χ² per sample stays below this. Halved or doubled it changes no case (of 26
/// design cases).
const NOISE_ALONE: f64 = 2.0;
/// The share of what is left that an effect must explain if its period is searched for among dozens: one of them
/// always explains something (decision 0032, found on design seeds; its sensitivity was not measured).
const NEARLY_ALL_SCANNED: f64 = 0.92;
/// A gain below this share of the first gap is computed again on the fine grid. Halved or doubled it
/// changes no case (of 26 design cases).
const FINE_BELOW: f64 = 2e-2;
/// A base parameter is named when it lies further off than this many tolerances. Half of it changes no case, twice it
/// loses one pair (of 26 design cases).
const BEYOND: f64 = 3.0;

/// A base parameter contradicts a data sheet from this factor on. Windings and loads of one type differ by less than 2, and friction that
/// is hidden beside an inertia three times too large makes it look like 2.3.
const CONTRADICTED: f64 = 2.2;

/// True if a ratio lies beyond what any motor of the type could have.
pub(super) fn far(ratio: f64) -> bool {
    ratio.ln().abs() > CONTRADICTED.ln()
}

/// What is known of an accepted set, once it was asked for.
#[derive(Default)]
pub(super) struct Accepted<'a> {
    /// Its χ² on the folds that were not fitted.
    validated: OnceLock<f64>,
    /// The set on the fine grid.
    fine: OnceLock<Scored<'a>>,
}

/// What a larger set gains.
struct Gain {
    /// Fall of the cost: χ² and priors.
    cost: f64,
    /// Dispersion of what is left.
    dispersion: f64,
    /// True if it is large enough to be a physical effect.
    material: bool,
}

impl<'a> Search<'a, '_> {
    /// True if a larger set pays for itself against the accepted one.
    pub(super) fn accepts(&self, current: &Scored<'a>, accepted: &Accepted<'a>, child: &Scored<'a>) -> bool {
        let gained = self.gained(current, accepted, child);
        let gain = gained.cost;
        let more =
            (child.hypothesis.effect_slots() as f64 - current.hypothesis.effect_slots() as f64).max(1.0);
        if gain < worth(gained.dispersion) * more.sqrt() || !gained.material {
            return false;
        }
        if self.any_inside_tolerance(child) || !self.stands_out(current, child) {
            return false;
        }
        let (before, after) = rayon::join(
            || *accepted.validated.get_or_init(|| cross_validated(current)),
            || cross_validated(child),
        );
        let validated = before - after;
        let base_only = child.hypothesis.items.iter().filter(|item| item.effect.is_base_parameter()).count()
            == child.hypothesis.items.len();
        validated > if base_only { -0.25 * gain } else { 0.25 * gain.min(current.fit.chi2 - child.fit.chi2) }
    }

    /// What a larger set gains. A gain that is small against the first gap is looked at on the fine grid: on the coarse one the
    /// integrator's own error beside a large effect looks like another.
    fn gained(&self, current: &Scored<'a>, accepted: &Accepted<'a>, child: &Scored<'a>) -> Gain {
        let weighed = |current: &Scored, child: &Scored, dispersion: f64| Gain {
            cost: current.fit.cost - child.fit.cost,
            dispersion,
            material: self.material(current, child, dispersion),
        };
        if current.fit.cost - child.fit.cost > FINE_BELOW * self.first_gap {
            return weighed(current, child, dispersion(child));
        }
        let (current, child) =
            rayon::join(|| accepted.fine.get_or_init(|| self.fine(current)), || self.fine(child));
        weighed(current, &child, dispersion_on(&child, &FINAL))
    }

    /// Visible against the noise, and a share of what is left and of the first gap.
    fn material(&self, current: &Scored, child: &Scored, dispersion: f64) -> bool {
        let samples = child.fit.samples as f64;
        let gain = current.fit.cost - child.fit.cost;
        let rest = (current.fit.chi2 - samples).max(1e-9);
        let first = self.first_gap - samples;
        let newest = child.hypothesis.items.last();
        let scanned = newest.is_some_and(|item| item.effect.starts.scans());
        let needed = match (scanned, dispersion < NOISE_ALONE) {
            (true, _) => NEARLY_ALL_SCANNED,
            (false, true) => MOST,
            (false, false) => NEARLY_ALL,
        };
        let explains_nearly_all = gain > needed * rest;
        let large = gain > SHARE_OF_REST * rest && gain > SHARE_OF_GAP * first;
        // Where the noise itself is reached, its own uncertainty of some per cent must not be named.
        let at_noise = (!current.hypothesis.items.is_empty() && current.fit.chi2 < samples)
            || (!self.model.known.is_empty() && self.at_floor(current));
        let visible = match (scanned && !current.hypothesis.items.is_empty(), at_noise) {
            (true, _) => VISIBLE_LINE,
            (false, true) => VISIBLE_IN_NOISE,
            (false, false) => VISIBLE,
        };
        gain / samples > visible * visible
            && (current.hypothesis.items.is_empty() && gain > SHARE_OF_REST * rest
                || explains_nearly_all
                || large)
    }

    /// True if the newest effect, if its period is looked for, is one line and not one of many.
    pub(super) fn stands_out(&self, current: &Scored<'a>, child: &Scored<'a>) -> bool {
        let Some(newest) = child.hypothesis.items.last().filter(|item| item.effect.starts.scans()) else {
            return true;
        };
        let others = child.hypothesis.items.len() - 1;
        let residuals = |scored: &Scored| Basis::new(&scored.hypothesis, &scored.fit.x);
        let without = if child.hypothesis.names()[..others] == current.hypothesis.names() {
            residuals(current)
        } else {
            residuals(&self.without(child, others, &SEARCH))
        };
        without.line_goes(&residuals(child), self.dataset, newest.effect, dispersion(child))
    }

    /// A set without its effects that stay inside their tolerance: what was named for want of a better may be put right by the
    /// newest effect.
    pub(super) fn pruned(&self, child: &Scored<'a>) -> Scored<'a> {
        let mut best = child.clone();
        while let Some(index) = self.inside(&best) {
            best = self.without(&best, index, &SEARCH);
        }
        best
    }

    pub(super) fn any_inside_tolerance(&self, scored: &Scored) -> bool {
        self.inside(scored).is_some()
    }

    /// The first effect that stays inside its tolerance.
    fn inside(&self, scored: &Scored) -> Option<usize> {
        let mut items = scored.hypothesis.items.iter().enumerate();
        items
            .find(|(index, item)| self.inside_tolerance(&scored.hypothesis, *index, item, &scored.fit.x))
            .map(|(index, _)| index)
    }
    /// A freed base parameter that stays near its nominal value is no effect, and neither is a gain or a scale near 1.
    fn inside_tolerance(&self, hypothesis: &Hypothesis, index: usize, item: &Item, x: &[f64]) -> bool {
        let Some(number) = item.effect.relations.multiplies else {
            return false;
        };
        let shift = hypothesis.value(index, 0, x).ln().abs();
        shift < BEYOND * tolerance(self.model, number.tolerance_key(self.model.linear()))
    }

    pub(super) fn at_floor(&self, scored: &Scored) -> bool {
        let samples = scored.fit.samples as f64;
        scored.fit.chi2 / samples < 1.0 + 3.0 * (2.0 / samples).sqrt() + VISIBLE * VISIBLE
    }
}

/// χ² of each fold predicted by the fit of the other.
pub(super) fn cross_validated(scored: &Scored) -> f64 {
    const FIT_A: Setting = Setting { parts: &[Part::A], iterations: 6, ..SEARCH };
    const FIT_B: Setting = Setting { parts: &[Part::B], iterations: 6, ..SEARCH };
    let folds = [(FIT_A, FIT_B), (FIT_B, FIT_A)];
    let predicted = each(&folds).map(|(train, test)| {
        let trained = fit(&scored.hypothesis, &scored.fit.x, train);
        chi2(&scored.hypothesis, &trained.x, test).0
    });
    predicted.collect::<Vec<f64>>().iter().sum()
}
