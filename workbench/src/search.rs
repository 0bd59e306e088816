//! Which effects are missing: every candidate is fitted by simulation error, sets grow by a beam, and a set must pay
//! for itself on the log (fit and cross-validation), be visible, and survive backward elimination.

use crate::bench::{Bench, Part};
use crate::effects::{Effect, Family, LIBRARY, Starts};
use crate::fit::{Evaluator, FINAL, FINE, Fit, Jacobian, SEARCH, Setting, dot, fit, fit_near};
use crate::hypothesis::{Hypothesis, Item, Slot};
use crate::model::Model;
use crate::starts::Basis;
use nalgebra::DVector;
use rayon::prelude::*;
use std::cell::OnceCell;

/// Sets that are grown further side by side.
const BEAM: usize = 3;
/// Candidates that are fitted at all, of those that promise most.
const FIRST_ROUND: usize = 40;
/// … and of those that could take the place of an accepted effect.
const EXCHANGE_ROUND: usize = 8;
/// Exchanges at most.
const EXCHANGES: usize = 3;
/// Candidates that are fitted beyond their first two iterations.
const SECOND_ROUND: usize = 7;
/// Candidates that are fitted to the end.
const THIRD_ROUND: usize = 4;
/// Multiples of a start's change of the residual that its promise may assume.
const LEAST_SHARE: f64 = 0.3;
const MOST_SHARE: f64 = 2.0;
/// … and that of a candidate, whose smallest start may be far too large for a small gap.
const SMALLEST_SHARE: f64 = 0.02;
/// A round is fitted only if a start promises this part of what a name must gain.
const HOPE: f64 = 0.3;
/// Most effects of a set.
const DEEPEST: usize = 5;
/// Gain in χ² that one more effect must bring, times over-dispersion and inflation.
const WORTH: f64 = 12.0;
/// Sets closer than this, times the same factors, are a tie.
const TIED: f64 = 10.0;
/// Smallest visibility (rms change over the noise) of an effect: at a tenth and less nothing can be named reliably.
const VISIBLE: f64 = 0.13;
/// The same for a further effect when the residual is already as small as the noise.
const VISIBLE_IN_NOISE: f64 = 0.22;
/// Smallest share of what is left that an effect must explain.
const SHARE_OF_REST: f64 = 0.05;
/// Smallest share of the first gap (squared): below it, the imperfect form of a large effect attracts second names …
const SHARE_OF_GAP: f64 = 1e-2;
/// … unless the name explains so much of what is left: a form that is wrong leaves something else, too.
const NEARLY_ALL: f64 = 0.8;
/// The same for an effect whose period is looked for among dozens: one of them always explains something.
const NEARLY_ALL_SCANNED: f64 = 0.92;
/// A base parameter is named when it is further off than this many tolerances.
const BEYOND: f64 = 3.0;

/// A fitted set.
#[derive(Clone, Debug)]
pub struct Scored<'a> {
    /// The set.
    pub hypothesis: Hypothesis<'a>,
    /// Its fit.
    pub fit: Fit,
    /// Cost and penalty for its parameters: lower is better.
    pub score: f64,
}

/// A candidate before its fits.
struct Screened<'a> {
    hypothesis: Hypothesis<'a>,
    /// The most promising starts, best first.
    starts: Vec<Vec<f64>>,
    /// The cost that the best of them promises.
    promise: f64,
    /// Which set of the beam it grew from.
    parent: usize,
}

/// A start after the parent's numbers followed.
struct Start {
    /// The cost that it promises.
    promise: f64,
    /// The same if its size is left open.
    hope: f64,
    x: Vec<f64>,
}

/// A candidate after its first fit.
struct Entered<'a> {
    it: Screened<'a>,
    scored: Scored<'a>,
}

impl<'a> AsRef<Scored<'a>> for Entered<'a> {
    fn as_ref(&self) -> &Scored<'a> {
        &self.scored
    }
}

impl<'a> AsMut<Scored<'a>> for Entered<'a> {
    fn as_mut(&mut self) -> &mut Scored<'a> {
        &mut self.scored
    }
}

impl AsRef<Self> for Scored<'_> {
    fn as_ref(&self) -> &Self {
        self
    }
}

impl AsMut<Self> for Scored<'_> {
    fn as_mut(&mut self) -> &mut Self {
        self
    }
}

/// What the search found.
pub struct Found<'a> {
    /// The base inside its tolerances.
    pub base: Scored<'a>,
    /// The accepted set, finely fitted.
    pub best: Scored<'a>,
    /// Other sets of the last round, finely fitted, best first.
    pub others: Vec<Scored<'a>>,
    /// All singles of the first round, best first.
    pub singles: Vec<Scored<'a>>,
    /// The best candidate that was not accepted in the last round.
    pub declined: Option<Scored<'a>>,
}

/// Called with the effects found so far and the number of candidates tried.
pub type Progress<'p> = &'p (dyn Fn(&str) + Sync);

/// Searches the library. `excluded`: names that are not offered.
pub fn search<'a>(bench: &'a Bench, model: &'a Model, excluded: &[String], progress: Progress) -> Found<'a> {
    let base = base_fit(bench, model);
    let mut search = Search {
        bench,
        model,
        excluded,
        progress,
        first_gap: base.fit.chi2,
        dispersion: 1.0,
    };
    search.dispersion = dispersion(&base);
    let mut current = base.clone();
    let mut beam = vec![base.clone()];
    let (mut singles, mut others, mut declined) = (Vec::new(), Vec::new(), None);
    let mut patience = 1;
    for depth in 1..=DEEPEST {
        progress(&format!("round {depth}: {}", current.label()));
        let children = search.expand(&beam);
        // Nothing promises to pay.
        if children.is_empty() {
            break;
        }
        if depth == 1 {
            singles = children.clone();
        }
        let validated = OnceCell::new();
        let winner = children
            .iter()
            .take(BEAM)
            .find(|child| search.accepts(&current, &validated, child))
            .cloned();
        beam = children.iter().take(BEAM).cloned().collect();
        match winner {
            Some(winner) => {
                others = children
                    .into_iter()
                    .filter(|child| child.hypothesis.names() != winner.hypothesis.names())
                    .take(12)
                    .collect();
                search.dispersion = dispersion(&winner);
                current = search.refined(winner);
                beam.insert(0, current.clone());
                beam.truncate(BEAM);
                patience = 1;
            }
            None => {
                declined = declined.or_else(|| children.first().cloned());
                if patience == 0
                    || search.at_floor(&current)
                    || children[0].fit.cost > 0.95 * current.fit.cost
                {
                    break;
                }
                patience -= 1;
            }
        }
    }
    let (current, exchanged) = search.exchanged(current);
    others.extend(exchanged);
    let best = search.eliminated(search.fine(&current));
    let others = search.rivals(&best, others, &singles);
    Found {
        base: search.fine(&base),
        best,
        others,
        singles,
        declined,
    }
}

impl Scored<'_> {
    /// The effects' names with plus signs.
    pub fn label(&self) -> String {
        if self.hypothesis.items.is_empty() {
            "the model as given".into()
        } else {
            self.hypothesis.names().join(" + ")
        }
    }
}

/// The base inside its tolerances.
pub fn base_fit<'a>(bench: &'a Bench, model: &'a Model) -> Scored<'a> {
    let hypothesis = Hypothesis::new(bench, model, Vec::new());
    let start = vec![0.0; hypothesis.slots.len()];
    let fit = fit(&hypothesis, &start, &SEARCH);
    Scored {
        score: fit.cost,
        hypothesis,
        fit,
    }
}

struct Search<'a, 'p> {
    bench: &'a Bench,
    model: &'a Model,
    excluded: &'p [String],
    progress: Progress<'p>,
    /// χ² of the base inside its tolerances.
    first_gap: f64,
    /// Over-dispersion times inflation by correlation, of the best set so far.
    dispersion: f64,
}

/// χ² per sample beyond 1, times the inflation of a mean's variance by the residual's correlation.
pub fn dispersion(scored: &Scored) -> f64 {
    let mut evaluator = Evaluator::new(&scored.hypothesis, &SEARCH);
    let mut residuals = Vec::new();
    evaluator.residuals(&scored.fit.x, &mut residuals);
    residuals.truncate(scored.fit.samples);
    let mean_square = dot(&residuals, &residuals) / residuals.len() as f64;
    mean_square.max(1.0) * crate::residual::inflation(&residuals)
}

impl<'a> Search<'a, '_> {
    /// All sets that have one effect more than a set of the beam, best first.
    fn expand(&self, beam: &[Scored<'a>]) -> Vec<Scored<'a>> {
        let bases: Vec<Basis> = beam
            .iter()
            .map(|parent| Basis::new(&parent.hypothesis, &parent.fit.x))
            .collect();
        let mut tasks: Vec<(usize, &'static Effect)> = Vec::new();
        let mut seen: Vec<Vec<String>> = Vec::new();
        for (index, parent) in beam.iter().enumerate() {
            for effect in LIBRARY.iter().filter(|effect| self.offers(parent, effect)) {
                let mut names = parent.hypothesis.names();
                names.push(effect.name.to_owned());
                names.sort();
                if !seen.contains(&names) {
                    seen.push(names);
                    tasks.push((index, effect));
                }
            }
        }
        self.fitted(beam, &bases, tasks, FIRST_ROUND)
    }

    /// Screens the tasks (set of the beam, new effect) and fits those that promise most.
    fn fitted(
        &self,
        beam: &[Scored<'a>],
        bases: &[Basis],
        tasks: Vec<(usize, &'static Effect)>,
        most: usize,
    ) -> Vec<Scored<'a>> {
        let projectors: Vec<Projector> = beam.par_iter().map(Projector::new).collect();
        let screened = tasks.par_iter().map(|(index, effect)| {
            (self.progress)("");
            Screened {
                parent: *index,
                ..self.screened(&beam[*index], &bases[*index], &projectors[*index], effect)
            }
        });
        let mut screened: Vec<Screened<'a>> = screened.collect();
        screened.sort_by(|a, b| a.promise.total_cmp(&b.promise));
        let hoped = |it: &Screened| {
            let parent = &beam[it.parent].fit;
            let visible = VISIBLE * VISIBLE * parent.samples as f64;
            parent.cost - it.promise > HOPE * visible.max(WORTH * self.dispersion)
        };
        if !screened.iter().any(hoped) {
            return Vec::new();
        }
        screened.truncate(most);
        self.raced(screened, &projectors)
    }

    /// Fits in three rounds, each longer and for fewer candidates; all of them are returned, best first.
    fn raced(&self, screened: Vec<Screened<'a>>, projectors: &[Projector]) -> Vec<Scored<'a>> {
        let lasting = |iterations| Setting { iterations, ..SEARCH };
        let near = |it: &Screened<'a>, x: &[f64], setting: &Setting| {
            let projector = &projectors[it.parent];
            let made = fit_near(&it.hypothesis, x, setting, &|slot| projector.column(slot));
            self.scored(it.hypothesis.clone(), made)
        };
        let mut field: Vec<Entered<'a>> = screened
            .into_par_iter()
            .filter_map(|it| {
                let scored = near(&it, it.starts.first()?, &lasting(2));
                Some(Entered { it, scored })
            })
            .collect();
        rank(&mut field);
        let again = |Entered { it, scored }: &Entered<'a>| {
            let other = it.starts.get(1).map(|x| near(it, x, &lasting(3)));
            let on = match other {
                Some(other) if other.fit.cost < scored.fit.cost => other,
                _ => scored.clone(),
            };
            self.refit(&on, &lasting(5))
        };
        let mut near_best: Vec<Scored<'a>> = field.par_iter().take(SECOND_ROUND).map(again).collect();
        rank(&mut near_best);
        let full: Vec<Scored<'a>> = near_best
            .par_iter()
            .take(THIRD_ROUND)
            .map(|child| self.refit(child, &SEARCH))
            .collect();
        near_best.splice(0..full.len(), full);
        near_best.extend(field.into_iter().skip(SECOND_ROUND).map(|entered| entered.scored));
        rank(&mut near_best);
        near_best
    }

    fn offers(&self, parent: &Scored, effect: &'static Effect) -> bool {
        !self.excluded.iter().any(|name| name == effect.name) && parent.hypothesis.admits(effect)
    }

    /// One more effect: its starts, best first, the parent's numbers projected out. Starts that move an optional
    /// parameter belong to the full form; the form that promises more stays.
    fn screened(
        &self,
        parent: &Scored<'a>,
        basis: &Basis,
        projector: &Projector,
        effect: &'static Effect,
    ) -> Screened<'a> {
        let moves = |start: &&Vec<f64>| {
            let pairs = effect.parameters.iter().zip(start.iter());
            pairs
                .filter_map(|(parameter, value)| Some((parameter.default?, value)))
                .any(|(default, value)| default != *value)
        };
        let starts = basis.starts(self.bench, effect);
        let (full, plain): (Vec<&Vec<f64>>, Vec<&Vec<f64>>) = starts.iter().partition(moves);
        let plain = self.formed(parent, projector, Item { effect, full: false }, &plain);
        if full.is_empty() {
            return plain;
        }
        let full = self.formed(parent, projector, Item { effect, full: true }, &full);
        if full.promise < plain.promise { full } else { plain }
    }

    /// One more effect in one form.
    fn formed(
        &self,
        parent: &Scored<'a>,
        projector: &Projector,
        item: Item,
        grid: &[&Vec<f64>],
    ) -> Screened<'a> {
        let mut items = parent.hypothesis.items.clone();
        items.push(item);
        let hypothesis = Hypothesis::new(self.bench, self.model, items);
        let mut evaluator = Evaluator::new(&hypothesis, &SEARCH);
        let mut residuals = Vec::new();
        let mut starts: Vec<Start> = Vec::with_capacity(grid.len());
        for start in grid {
            let x = started(&hypothesis, parent, start);
            evaluator.residuals(&x, &mut residuals);
            starts.push(projector.projected(&hypothesis, &x, &residuals));
        }
        starts.sort_by(|a, b| a.promise.total_cmp(&b.promise));
        drop(evaluator);
        Screened {
            promise: starts
                .iter()
                .map(|start| start.hope)
                .fold(f64::INFINITY, f64::min),
            parent: 0,
            hypothesis,
            starts: starts.into_iter().map(|start| start.x).take(2).collect(),
        }
    }

    /// One more effect, fitted from its best two starts.
    fn child(
        &self,
        parent: &Scored<'a>,
        basis: &Basis,
        projector: &Projector,
        effect: &'static Effect,
    ) -> Option<Scored<'a>> {
        let screened = self.screened(parent, basis, projector, effect);
        let fits = screened
            .starts
            .iter()
            .map(|x| fit_near(&screened.hypothesis, x, &SEARCH, &|slot| projector.column(slot)));
        let best = fits.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        Some(self.scored(screened.hypothesis, best))
    }

    fn scored(&self, hypothesis: Hypothesis<'a>, fit: Fit) -> Scored<'a> {
        Scored {
            score: fit.cost + self.dispersion * penalty(&hypothesis, fit.samples),
            hypothesis,
            fit,
        }
    }

    fn refit(&self, scored: &Scored<'a>, setting: &Setting) -> Scored<'a> {
        let made = fit(&scored.hypothesis, &scored.fit.x, setting);
        self.scored(scored.hypothesis.clone(), made)
    }

    fn fine(&self, scored: &Scored<'a>) -> Scored<'a> {
        self.refit(scored, &FINAL)
    }

    /// Tries the richer and the poorer forms of each effect (a softness, two sides instead of one).
    fn refined(&self, scored: Scored<'a>) -> Scored<'a> {
        let mut best = self.scored(scored.hypothesis, scored.fit);
        for index in 0..best.hypothesis.items.len() {
            let variants: Vec<Item> = self.variants(&best.hypothesis, index);
            let tried: Vec<Scored<'a>> = variants
                .par_iter()
                .filter_map(|item| self.replaced(&best, index, *item))
                .collect();
            for other in tried {
                let more = other.hypothesis.effect_slots() > best.hypothesis.effect_slots();
                let margin = if more {
                    WORTH * self.dispersion.min(dispersion(&other))
                } else {
                    0.0
                };
                if other.score + margin < best.score {
                    best = other;
                }
            }
        }
        best
    }

    /// Replaces one effect of a set at a time by any other, as long as that helps: a first name that explained much of two
    /// effects together is not dropped by elimination alone. The sets that lost are the rivals.
    fn exchanged(&self, scored: Scored<'a>) -> (Scored<'a>, Vec<Scored<'a>>) {
        let (mut best, mut lost) = (scored, Vec::new());
        for _ in 0..EXCHANGES {
            if best.hypothesis.items.len() < 2 {
                break;
            }
            let before = best.clone();
            for index in 0..before.hypothesis.items.len() {
                let parents = [self.without(&before, index, &SEARCH)];
                let bases = [Basis::new(&parents[0].hypothesis, &parents[0].fit.x)];
                let left_out = before.hypothesis.items[index].effect;
                let others = LIBRARY.iter().filter(|effect| effect.name != left_out.name);
                let tasks = others
                    .filter(|effect| self.offers(&parents[0], effect))
                    .map(|e| (0, e));
                let children = self.fitted(&parents, &bases, tasks.collect(), EXCHANGE_ROUND);
                lost.extend(children);
            }
            let factor = dispersion(&best);
            let better = |child: &&Scored<'a>| {
                child.hypothesis.items.len() == best.hypothesis.items.len()
                    && score_with(child, factor) + WORTH * factor < score_with(&best, factor)
                    && !self.any_inside_tolerance(child)
            };
            let least =
                |a: &&Scored<'a>, b: &&Scored<'a>| score_with(a, factor).total_cmp(&score_with(b, factor));
            let Some(winner) = lost.iter().filter(better).min_by(least).cloned() else {
                break;
            };
            lost.push(std::mem::replace(&mut best, self.refined(winner)));
        }
        (best, lost)
    }

    fn any_inside_tolerance(&self, scored: &Scored) -> bool {
        let items = scored.hypothesis.items.iter().enumerate();
        items
            .into_iter()
            .any(|(index, item)| self.inside_tolerance(&scored.hypothesis, index, item, &scored.fit.x))
    }

    fn variants(&self, hypothesis: &Hypothesis<'a>, index: usize) -> Vec<Item> {
        let item = hypothesis.items[index];
        let mut variants = Vec::new();
        if item.can_grow() {
            variants.push(Item { full: true, ..item });
        }
        if !matches!(item.effect.family, Family::Own(_)) {
            let twins = LIBRARY
                .iter()
                .filter(|other| other.family == item.effect.family && other.name != item.effect.name);
            let allowed = twins.filter(|other| !self.excluded.iter().any(|name| name == other.name));
            variants.extend(allowed.map(|effect| Item { effect, full: false }));
        }
        variants
    }

    /// The same set with one effect in another form.
    fn replaced(&self, scored: &Scored<'a>, index: usize, item: Item) -> Option<Scored<'a>> {
        let mut items = scored.hypothesis.items.clone();
        items[index] = item;
        let hypothesis = Hypothesis::new(self.bench, self.model, items);
        if item.effect.name == scored.hypothesis.items[index].effect.name {
            let fits = [0.03, 0.2].map(|soft| {
                let default = |slot: &Slot| {
                    if matches!(slot, Slot::Effect { .. }) {
                        soft
                    } else {
                        0.0
                    }
                };
                fit(
                    &hypothesis,
                    &hypothesis.carried(&scored.hypothesis, &scored.fit.x, &default),
                    &SEARCH,
                )
            });
            let best = fits.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))?;
            return Some(self.scored(hypothesis, best));
        }
        let mut others = scored.hypothesis.items.clone();
        others.remove(index);
        let without = Hypothesis::new(self.bench, self.model, others);
        let x = without.carried(&scored.hypothesis, &scored.fit.x, &|_| 0.0);
        let parent = self.scored(
            without,
            Fit {
                x,
                ..scored.fit.clone()
            },
        );
        let basis = Basis::new(&parent.hypothesis, &parent.fit.x);
        let child = self.child(&parent, &basis, &Projector::new(&parent), item.effect)?;
        // Back to the order of naming.
        let reordered = hypothesis.carried(&child.hypothesis, &child.fit.x, &|_| 0.0);
        Some(self.scored(
            hypothesis,
            Fit {
                x: reordered,
                ..child.fit
            },
        ))
    }

    /// Whether a larger set pays for itself against the accepted one.
    fn accepts(&self, current: &Scored<'a>, validated: &OnceCell<f64>, child: &Scored<'a>) -> bool {
        let gain = current.fit.cost - child.fit.cost;
        let factor = dispersion(child);
        let more =
            (child.hypothesis.effect_slots() as f64 - current.hypothesis.effect_slots() as f64).max(1.0);
        if gain < WORTH * factor * more.sqrt() || !self.material(current, child) {
            return false;
        }
        if self.any_inside_tolerance(child) {
            return false;
        }
        let validated = validated.get_or_init(|| cross_validated(current)) - cross_validated(child);
        let base_only = child
            .hypothesis
            .items
            .iter()
            .filter(|item| item.effect.is_base_parameter())
            .count()
            == child.hypothesis.items.len();
        validated
            > if base_only {
                -0.25 * gain
            } else {
                0.25 * gain.min(current.fit.chi2 - child.fit.chi2)
            }
    }

    /// Visible against the noise, and a share of what is left and of the first gap.
    fn material(&self, current: &Scored, child: &Scored) -> bool {
        let samples = child.fit.samples as f64;
        let gain = current.fit.cost - child.fit.cost;
        let rest = (current.fit.chi2 - samples).max(1e-9);
        let first = self.first_gap - samples;
        let newest = child.hypothesis.items.last().map(|item| item.effect.starts);
        let scanned = matches!(newest, Some(Starts::PositionScan | Starts::TimeScan));
        let explains_nearly_all = gain > if scanned { NEARLY_ALL_SCANNED } else { NEARLY_ALL } * rest;
        let large = gain > SHARE_OF_REST * rest && gain > SHARE_OF_GAP * first;
        // Where the noise itself is reached, its own uncertainty of some per cent must not be named.
        let at_noise = !current.hypothesis.items.is_empty() && current.fit.chi2 < samples;
        let visible = if at_noise { VISIBLE_IN_NOISE } else { VISIBLE };
        gain / samples > visible * visible
            && (current.hypothesis.items.is_empty() && gain > SHARE_OF_REST * rest
                || explains_nearly_all
                || large)
    }

    /// A freed base parameter that stays near its nominal value is no effect, and neither is a gain or a scale near 1.
    fn inside_tolerance(&self, hypothesis: &Hypothesis, index: usize, item: &Item, x: &[f64]) -> bool {
        let key = match item.effect.name {
            "resistance" => "R_ohm",
            "motor_gain" => "Kt_nm_per_a",
            "inertia" if self.model.linear() => "mass_kg",
            "inertia" => "J_kgm2",
            "viscous_friction" => "b_nms_per_rad",
            "drive_gain" => "drive_gain",
            "encoder_scale" => "encoder_scale",
            _ => return false,
        };
        let shift = hypothesis.value(index, 0, x).ln().abs();
        shift < BEYOND * self.model.tolerance(key)
    }

    fn at_floor(&self, scored: &Scored) -> bool {
        let samples = scored.fit.samples as f64;
        scored.fit.chi2 / samples < 1.0 + 3.0 * (2.0 / samples).sqrt() + VISIBLE * VISIBLE
    }

    /// Drops every effect whose removal costs too little, on the fine grid.
    fn eliminated(&self, scored: Scored<'a>) -> Scored<'a> {
        let mut best = scored;
        'again: loop {
            if best.hypothesis.items.len() < 2 {
                return best;
            }
            let factor = dispersion(&best);
            let smaller: Vec<Scored<'a>> = (0..best.hypothesis.items.len())
                .into_par_iter()
                .map(|index| self.without(&best, index, &FINAL))
                .collect();
            let cheapest = smaller
                .into_iter()
                .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))
                .expect("two or more");
            let samples = best.fit.samples as f64;
            let cost = cheapest.fit.cost - best.fit.cost;
            let too_little = cost < WORTH * factor || cost / samples < VISIBLE * VISIBLE;
            if too_little || self.any_inside_tolerance(&best) {
                best = cheapest;
                continue 'again;
            }
            return best;
        }
    }

    /// The set without one effect, refitted from its own values and from the base's nominal ones.
    fn without(&self, scored: &Scored<'a>, index: usize, setting: &Setting) -> Scored<'a> {
        let mut items = scored.hypothesis.items.clone();
        items.remove(index);
        let hypothesis = Hypothesis::new(self.bench, self.model, items);
        let x = hypothesis.carried(&scored.hypothesis, &scored.fit.x, &|_| 0.0);
        let made = fit(&hypothesis, &x, setting);
        self.scored(hypothesis, made)
    }

    /// Sets of the same size as the best that come near, finely fitted, best first.
    fn rivals(&self, best: &Scored<'a>, others: Vec<Scored<'a>>, singles: &[Scored<'a>]) -> Vec<Scored<'a>> {
        let size = best.hypothesis.items.len();
        let pool = others.into_iter().chain(singles.iter().cloned());
        let mut near: Vec<Scored<'a>> = Vec::new();
        for other in pool.filter(|other| other.hypothesis.items.len() == size && size > 0) {
            let names = sorted_names(&other);
            if !same_family_set(&other.hypothesis, &best.hypothesis)
                && names != sorted_names(best)
                && !near.iter().any(|known| sorted_names(known) == names)
            {
                near.push(other);
            }
        }
        near.sort_by(|a, b| a.score.total_cmp(&b.score));
        let margin = 5.0 * TIED * dispersion(best);
        near.retain(|other| other.fit.cost - best.fit.cost < margin);
        near.truncate(6);
        let mut fine: Vec<Scored<'a>> = near.par_iter().map(|other| self.fine(other)).collect();
        fine.sort_by(|a, b| a.score.total_cmp(&b.score));
        fine
    }
}

/// What a set pays for its parameters (Schwarz, Annals of Statistics 6, 1978).
fn penalty(hypothesis: &Hypothesis, samples: usize) -> f64 {
    (2.0 * samples as f64).ln() * hypothesis.effect_slots() as f64
}

/// The score of a set, its penalty measured by another set's dispersion.
fn score_with(scored: &Scored, factor: f64) -> f64 {
    scored.fit.cost + factor * penalty(&scored.hypothesis, scored.fit.samples)
}

/// Sorts sets by score, best first, the penalty measured by the dispersion of the set that fits best: with the
/// dispersion of a set that lacks an effect, a second parameter could never pay.
fn rank<'a, T: AsMut<Scored<'a>> + AsRef<Scored<'a>>>(sets: &mut [T]) {
    let costs = |set: &T| set.as_ref().fit.cost;
    let Some(nearest) = sets.iter().min_by(|a, b| costs(a).total_cmp(&costs(b))) else {
        return;
    };
    let factor = dispersion(nearest.as_ref());
    for scored in sets.iter_mut().map(AsMut::as_mut) {
        scored.score = score_with(scored, factor);
    }
    sets.sort_by(|a, b| a.as_ref().score.total_cmp(&b.as_ref().score));
}

/// True if two sets differ only by richer or poorer forms of the same families: then the score has decided.
fn same_family_set(a: &Hypothesis, b: &Hypothesis) -> bool {
    let key = |item: &Item| match item.effect.family {
        Family::Own(name) => name.to_owned(),
        other => format!("{other:?}"),
    };
    let sorted = |h: &Hypothesis| {
        let mut keys: Vec<String> = h.items.iter().map(key).collect();
        keys.sort();
        keys
    };
    sorted(a) == sorted(b)
}

fn sorted_names(scored: &Scored) -> Vec<String> {
    let mut names = scored.hypothesis.names();
    names.sort();
    names
}

/// Sets that the data cannot tell from the best.
pub fn tied<'s, 'a>(best: &Scored<'a>, others: &'s [Scored<'a>]) -> Vec<&'s Scored<'a>> {
    let margin = TIED * dispersion(best);
    others
        .iter()
        .filter(|other| other.fit.cost - best.fit.cost < margin)
        .collect()
}

/// χ² of each fold predicted by the fit of the other.
fn cross_validated(scored: &Scored) -> f64 {
    const FIT_A: Setting = Setting {
        parts: &[Part::A],
        iterations: 6,
        ..SEARCH
    };
    const FIT_B: Setting = Setting {
        parts: &[Part::B],
        iterations: 6,
        ..SEARCH
    };
    let folds = [(FIT_A, FIT_B), (FIT_B, FIT_A)];
    folds
        .par_iter()
        .map(|(train, test)| {
            let trained = fit(&scored.hypothesis, &scored.fit.x, train);
            chi2(&scored.hypothesis, &trained.x, test).0
        })
        .sum()
}

/// χ² and number of samples of a hypothesis on the parts of a setting.
pub fn chi2(hypothesis: &Hypothesis, x: &[f64], setting: &Setting) -> (f64, usize) {
    let mut residuals = Vec::new();
    Evaluator::new(hypothesis, setting).residuals(x, &mut residuals);
    let priors = hypothesis.slots.iter().filter(|slot| slot.has_prior()).count();
    residuals.truncate(residuals.len() - priors);
    (dot(&residuals, &residuals), residuals.len())
}

/// The residual on the held-out part, unweighted by anything but the noise.
pub const HELD_OUT: Setting = Setting {
    parts: &[Part::HoldOut],
    finest: FINE,
    iterations: 0,
};

/// Numbers of a child from its parent and a start of the new effect.
fn started(child: &Hypothesis, parent: &Scored, start: &[f64]) -> Vec<f64> {
    let new = child.items.len() - 1;
    let default = |slot: &Slot| match slot {
        Slot::Effect { item, parameter } if *item == new => start[*parameter],
        _ => 0.0,
    };
    let x = child.carried(&parent.hypothesis, &parent.fit.x, &default);
    x.iter()
        .enumerate()
        .map(|(k, v)| v.clamp(child.bounds(k).0, child.bounds(k).1))
        .collect()
}

/// Lets the parent's numbers follow a change of the residual, linearly and inside their bounds.
struct Projector {
    jacobian: Jacobian,
    factor: nalgebra::Cholesky<f64, nalgebra::Dyn>,
    slots: Vec<Slot>,
    /// The parent's own residual.
    residuals: Vec<f64>,
}

impl Projector {
    fn new(parent: &Scored) -> Self {
        let mut evaluator = Evaluator::new(&parent.hypothesis, &SEARCH);
        let mut residuals = Vec::new();
        evaluator.residuals(&parent.fit.x, &mut residuals);
        let jacobian = Jacobian::at(&mut evaluator, &parent.fit.x, &residuals);
        let mut normal = jacobian.normal();
        for k in 0..parent.fit.x.len() {
            normal[(k, k)] = normal[(k, k)] * (1.0 + 1e-9) + 1e-9;
        }
        let factor = normal.cholesky().expect("made positive");
        Self {
            jacobian,
            factor,
            slots: parent.hypothesis.slots.clone(),
            residuals,
        }
    }

    /// The parent's column of a number, unless it belongs to an effect.
    fn column(&self, slot: &Slot) -> Option<Vec<f64>> {
        let place = self.slots.iter().position(|other| other == slot)?;
        slot.has_prior().then(|| self.jacobian.columns[place].clone())
    }

    /// The cost that a start promises, and the start, after the parent's numbers followed. The promise holds for the
    /// best multiple of the change, because the grid of starts is coarse.
    fn projected(&self, child: &Hypothesis, x: &[f64], residuals: &[f64]) -> Start {
        let gradient: DVector<f64> = self.jacobian.gradient(residuals);
        let wanted = self.factor.solve(&-gradient);
        let (mut left, mut followed) = (residuals.to_vec(), x.to_vec());
        for (column, (slot, step)) in self
            .jacobian
            .columns
            .iter()
            .zip(self.slots.iter().zip(wanted.iter()))
        {
            let Some(twin) = child.slots.iter().position(|other| other == slot) else {
                continue;
            };
            let (lower, upper) = child.bounds(twin);
            followed[twin] = (x[twin] + step).clamp(lower, upper);
            let step = followed[twin] - x[twin];
            left.iter_mut().zip(column).for_each(|(r, c)| *r += step * c);
        }
        // The lowest cost on the way from the parent's residual through this one.
        let change: Vec<f64> = left.iter().zip(&self.residuals).map(|(l, r)| l - r).collect();
        let (slope, bend) = (dot(&self.residuals, &change), dot(&change, &change));
        let whole = dot(&self.residuals, &self.residuals);
        let along = |least: f64| {
            let share = (-slope / bend.max(1e-300)).clamp(least, MOST_SHARE);
            whole + share * (2.0 * slope + share * bend)
        };
        Start {
            promise: along(LEAST_SHARE),
            hope: along(SMALLEST_SHARE),
            x: followed,
        }
    }
}
