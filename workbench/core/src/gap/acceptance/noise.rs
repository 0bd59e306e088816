//! Names over a record, measured by the noise of its sensor.

use super::{Evidence, Weighed, price};
use crate::gap::dataset::{Dataset, Part};
use crate::gap::fit::hypothesis::{Item, tolerance};
use crate::gap::fit::initial_guesses::Basis;
use crate::gap::fit::scored::{Scored, chi2, dispersion, dispersion_on};
use crate::gap::fit::{FINAL, SEARCH, Setting, fit};
use crate::system::effects::Effect;
use crate::system::threads::{join, of_each};
use std::sync::OnceLock;

/// Smallest visibility of an effect: the rms change of the prediction over the noise. At a tenth and less nothing can
/// be named reliably (decision 0032). Origin: half of it changes no case, twice it loses one pair (of 26 design
/// cases).
pub const VISIBLE: f64 = 0.13;
/// Smallest visibility of a further effect when the residual is already as small as the noise. Origin: halved or
/// doubled it changes no case (of 26 design cases).
const VISIBLE_IN_NOISE: f64 = 0.22;
/// Smallest visibility of a further effect whose period is searched for. On a repeating trajectory the model error of
/// a large effect is periodic, too; hence a higher threshold. Origin: halved or doubled it changes no case (of 26
/// design cases).
const VISIBLE_LINE: f64 = 0.25;
/// Smallest share of the remaining squared gap that a further effect must explain (decision 0032). Origin: halved or
/// doubled it changes no case (of 26 design cases).
const SHARE_OF_REMAINDER: f64 = 0.05;
/// Smallest share of the first squared gap that a further effect must explain: below it, the imperfect form of a
/// large effect attracts second names (decision 0032). Origin: halved or doubled it changes no case (of 26 design
/// cases).
pub const SHARE_OF_GAP: f64 = 1e-2;
/// A further effect below [`SHARE_OF_GAP`] is still accepted if it explains this share of what is left: a form that
/// is wrong leaves something else, too (decision 0032). Origin: halved or doubled it changes no case (of 26 design
/// cases).
const NEARLY_ALL: f64 = 0.8;
/// This share of what is left is enough where nothing but noise remains after it. Origin: half of it changes no case,
/// twice it loses one pair (of 26 design cases).
const MOST: f64 = 0.6;
/// Nothing but noise remains where χ² per sample stays below this. Origin: halved or doubled it changes no case (of
/// 26 design cases).
const NOISE_ALONE: f64 = 2.0;
/// The share of what is left that an effect must explain if its period is searched for among dozens: one of them
/// always explains something (decision 0032). Origin: design cases; its sensitivity was not measured.
const NEARLY_ALL_SCANNED: f64 = 0.92;
/// A gain below this share of the first gap is computed again on the fine grid. Origin: halved or doubled it changes
/// no case (of 26 design cases).
const FINE_BELOW: f64 = 2e-2;
/// A base parameter is named when it lies further off than this many tolerances. Origin: half of it changes no case,
/// twice it loses one pair (of 26 design cases).
const BEYOND: f64 = 3.0;

/// A base parameter contradicts a data sheet from this factor on. Origin: windings and loads of one type differ by
/// less than 2 (judgement); in drawn cases friction that is hidden beside an inertia three times too large makes it
/// look like 2.3.
const CONTRADICTED: f64 = 2.2;

/// True if a ratio lies beyond what any motor of the type could have.
pub fn far(ratio: f64) -> bool {
    ratio.ln().abs() > CONTRADICTED.ln()
}

/// Part of a gain that must show on folds that were not fitted. Where base parameters alone are freed, so much may be
/// lost there. Chosen by judgement; not studied.
pub(super) const VALIDATED: f64 = 0.25;

/// What is known of the noise beside one set, which larger ones are weighed against.
pub struct Noise<'a> {
    /// χ² of the base inside its tolerances.
    first_gap: f64,
    /// χ² of the smaller set on the folds that were not fitted, once it was asked for.
    validated: OnceLock<f64>,
    /// The smaller set on the fine grid, once it was asked for.
    fine: OnceLock<Scored<'a>>,
}

impl<'a> Noise<'a> {
    /// For one smaller set. `first_gap`: χ² of the base inside its tolerances.
    pub fn new(first_gap: f64) -> Self {
        Self { first_gap, validated: OnceLock::new(), fine: OnceLock::new() }
    }

    /// Visible against the noise, and a share of what is left and of the first gap.
    fn is_material(&self, smaller: &Scored, larger: &Scored, dispersion: f64) -> bool {
        let samples = larger.fit.samples as f64;
        let gain = smaller.fit.cost - larger.fit.cost;
        let remainder = (smaller.fit.chi2 - samples).max(1e-9);
        let bare = smaller.hypothesis.items.is_empty();
        let scanned = newest_scanned(larger).is_some();
        let needed = match (scanned, dispersion < NOISE_ALONE) {
            (true, _) => NEARLY_ALL_SCANNED,
            (false, true) => MOST,
            (false, false) => NEARLY_ALL,
        };
        let a_share = gain > SHARE_OF_REMAINDER * remainder;
        let large = a_share && (bare || gain > SHARE_OF_GAP * (self.first_gap - samples));
        // Where the noise itself is reached, its own uncertainty of some per cent must not be named.
        let at_noise = (!bare && smaller.fit.chi2 < samples)
            || (!smaller.hypothesis.model.known.is_empty() && at_floor(smaller));
        let visible = match (scanned && !bare, at_noise) {
            (true, _) => VISIBLE_LINE,
            (false, true) => VISIBLE_IN_NOISE,
            (false, false) => VISIBLE,
        };
        gain / samples > visible * visible && (large || gain > needed * remainder)
    }
}

impl<'a> Evidence<'a> for Noise<'a> {
    type Data = Dataset;

    /// A gain that is small against the first gap is looked at on the fine grid: on the coarse one the integrator's own error
    /// beside a large effect looks like another.
    fn weighed(&self, smaller: &Scored<'a>, larger: &Scored<'a>) -> Weighed {
        let more = larger.hypothesis.effect_slots() as f64 - smaller.hypothesis.effect_slots() as f64;
        let weighed = |smaller: &Scored, larger: &Scored, dispersion: f64| Weighed {
            gain: smaller.fit.cost - larger.fit.cost,
            cost: price(dispersion) * more.max(1.0).sqrt(),
            material: self.is_material(smaller, larger, dispersion),
        };
        if smaller.fit.cost - larger.fit.cost > FINE_BELOW * self.first_gap {
            return weighed(smaller, larger, dispersion(larger));
        }
        let (smaller, larger) =
            join(|| self.fine.get_or_init(|| smaller.refitted(&FINAL)), || larger.refitted(&FINAL));
        weighed(smaller, &larger, dispersion_on(&larger, &FINAL))
    }

    fn confirmed(&self, smaller: &Scored<'a>, larger: &Scored<'a>, gain: f64) -> bool {
        if inside_tolerance(larger).is_some() || !stands_out(smaller, larger) {
            return false;
        }
        let (before, after) =
            join(|| *self.validated.get_or_init(|| cross_validated(smaller)), || cross_validated(larger));
        let base_only = larger.hypothesis.items.iter().all(|item| item.effect.is_base_parameter());
        let least = if base_only { -gain } else { gain.min(smaller.fit.chi2 - larger.fit.chi2) };
        before - after > VALIDATED * least
    }
}

/// What a set explains on the finest grid, where names are dropped. `dispersion`: of the set from which they are dropped.
pub struct FineNoise {
    /// How far its residuals are from independent noise.
    pub dispersion: f64,
}

impl<'a> Evidence<'a> for FineNoise {
    type Data = Dataset;

    fn weighed(&self, smaller: &Scored<'a>, larger: &Scored<'a>) -> Weighed {
        let gain = smaller.fit.cost - larger.fit.cost;
        let visible = gain / larger.fit.samples as f64 >= VISIBLE * VISIBLE;
        Weighed {
            gain,
            cost: price(self.dispersion),
            material: visible && inside_tolerance(larger).is_none(),
        }
    }
}

/// The newest effect of a set, if its period is looked for.
fn newest_scanned(scored: &Scored) -> Option<&'static Effect> {
    let newest = scored.hypothesis.items.last().map(|item| item.effect);
    newest.filter(|effect| effect.starts.scans())
}

/// True if the newest effect, if its period is looked for, is one line and not one of many.
pub(super) fn stands_out(smaller: &Scored, larger: &Scored) -> bool {
    let Some(effect) = newest_scanned(larger) else {
        return true;
    };
    let others = larger.hypothesis.items.len() - 1;
    let residuals = |scored: &Scored| Basis::new(&scored.hypothesis, &scored.fit.x);
    let without = if larger.hypothesis.names()[..others] == smaller.hypothesis.names() {
        residuals(smaller)
    } else {
        residuals(&larger.only(|k| k != others, &SEARCH))
    };
    without.line_goes(&residuals(larger), larger.hypothesis.dataset, effect, dispersion(larger))
}

/// The first effect of a set that stays inside its tolerance: a freed base parameter that stays near its nominal value is no
/// effect, and neither is a gain or a scale near 1.
pub fn inside_tolerance(scored: &Scored) -> Option<usize> {
    let (hypothesis, model) = (&scored.hypothesis, scored.hypothesis.model);
    let inside = |(index, item): (usize, &Item)| {
        item.effect.relations.multiplies.is_some_and(|number| {
            let shift = hypothesis.value(index, 0, &scored.fit.x).ln().abs();
            shift < BEYOND * tolerance(model, number.tolerance_key(model.linear()))
        })
    };
    hypothesis.items.iter().enumerate().position(inside)
}

/// True if a set leaves no more than the noise.
pub fn at_floor(scored: &Scored) -> bool {
    let samples = scored.fit.samples as f64;
    scored.fit.chi2 / samples < 1.0 + 3.0 * (2.0 / samples).sqrt() + VISIBLE * VISIBLE
}

/// χ² of each fold predicted by the fit of the other.
pub fn cross_validated(scored: &Scored) -> f64 {
    const FIT_A: Setting = Setting { parts: &[Part::A], iterations: 6, ..SEARCH };
    const FIT_B: Setting = Setting { parts: &[Part::B], iterations: 6, ..SEARCH };
    let predicted = of_each(&[(FIT_A, FIT_B), (FIT_B, FIT_A)], |(train, test)| {
        let trained = fit(&scored.hypothesis, &scored.fit.x, train);
        chi2(&scored.hypothesis, &trained.x, test).0
    });
    predicted.iter().sum()
}
