//! The search for a model that is itself a fit to the log of a real rig.
//!
//! Such a residual is never as small as the sensor's noise, so nothing is measured by the noise here. A name must remove a
//! share of the squared error: on the log, on the folds of the log that were not fitted, and on every held-out record. The
//! log chooses, each held-out record may refuse.
//!
//! ```text
//! plain forms: round → share of the log → veto … → elimination → richer forms, if they remove a share more → rivals
//! ```

use super::rounds::{BEAM, Path};
use super::worth::cross_validated;
use super::{Found, Offer, Search};
use crate::gap::effort::{Phase, during};
use crate::gap::fit::{Fit, SEARCH};
use crate::gap::hypothesis::{Hypothesis, Item};
use crate::gap::prediction::{held_out_errors, held_out_variation};
use crate::gap::scored::{Scored, compared, dispersion};
use crate::gap::threads::each;
use crate::system::effects::{Meaning, Starts};
use rayon::prelude::*;
use std::cell::OnceCell;

/// Richer forms that one after the other may join.
const RICHER_FORMS: usize = 2;
/// A set that leaves more than this part of the first gap (squared) may be the wrong one: all forms are then searched from the
/// beginning.
const MUCH: f64 = 0.1;
/// Part of the removed share that must show on folds that were not fitted.
const VALIDATED: f64 = 0.25;
/// Logarithm of the likelihood ratio that each further number must bring, the samples counted by their correlation: half of
/// Akaike's and of Schwarz's price at some hundred samples lies here.
const PER_NUMBER: f64 = 3.0;
/// Whole periods that a log must have seen before a period is named.
const PERIODS: f64 = 3.0;
/// Names that the held-out records may refuse in one round.
const VETOES: usize = 3;
/// A name that joins may leave so many times as much on one held-out record, if it leaves less on all of them together: a further
/// name may be what that record needs.
const WORSE: f64 = 1.05;
/// Without a name that stays, the squared error of every held-out record grows by this factor at least.
const HELPS_EACH: f64 = 1.05;
/// Searches that go on because a name of the whole set did not stay.
const AGAIN: usize = 3;

impl<'a> Search<'a, '_> {
    /// The whole search, by shares.
    pub(super) fn by_shares(self, base: Scored<'a>) -> Found<'a> {
        let mut path = Path::default();
        let plain = self.searched(Offer::Plain, &base, &mut path);
        let mut kept = during(Phase::Forms, || self.enriched(plain, &mut path));
        if kept.fit.chi2 > MUCH * self.first_gap && !self.at_floor(&kept) {
            let anew = self.searched(Offer::Forms, &base, &mut path);
            let replaces = self.replaces(&Asked::of(&kept), &anew);
            if replaces {
                path.others.push(std::mem::replace(&mut kept, anew));
            }
        }
        during(Phase::Rivals, || self.weeded(&base, kept, path))
    }

    /// What is left of a set when conventions, doubles and small names are through.
    fn weeded(&self, base: &Scored<'a>, kept: Scored<'a>, mut path: Path<'a>) -> Found<'a> {
        let kept = self.by_convention(kept, &mut path);
        let kept = self.one_friction(kept, &mut path);
        let kept = self.one_name_for_two(kept, &mut path);
        let (kept, worth) = self.without_small(kept, &mut path);
        let best = self.evened(self.fine(&self.by_weight(kept, worth)));
        self.found(base, best, path)
    }

    /// Names until none removes its share, then those that stay; again without those that did not: each may have stood in the place
    /// of a better one.
    fn searched(&self, offer: Offer, base: &Scored<'a>, path: &mut Path<'a>) -> Scored<'a> {
        let mut search = Search { offer, ..self.clone() };
        let mut kept = base.clone();
        for _ in 0..=AGAIN {
            let grown = search.grown(kept, path);
            let tried = grown.hypothesis.names();
            if tried.len() > path.dropped.len() {
                path.dropped = tried;
            }
            let (left, dropped) = during(Phase::Accept, || search.retained(grown));
            kept = left;
            if dropped.is_empty() {
                break;
            }
            search.excluded.extend(dropped);
        }
        kept
    }

    /// The plain set with richer forms of its effects, or one more of them, as long as that replaces it.
    fn enriched(&self, plain: Scored<'a>, path: &mut Path<'a>) -> Scored<'a> {
        let search = Search { offer: Offer::Forms, dispersion: dispersion(&plain), ..self.clone() };
        let mut best = plain;
        for _ in 0..RICHER_FORMS {
            (self.progress)(&format!("richer forms of {}", best.label()));
            let richer = search.richer(&best);
            let asked = Asked::of(&best);
            let Some(winner) = richer.into_iter().find(|child| self.replaces(&asked, child)) else {
                break;
            };
            let (winner, _) = search.retained(search.refit(&winner, &SEARCH));
            if !self.replaces(&asked, &winner) {
                break;
            }
            path.others.push(std::mem::replace(&mut best, winner));
        }
        best
    }

    /// The richer forms of each effect of a set, and the set with one rich effect more, best first.
    fn richer(&self, set: &Scored<'a>) -> Vec<Scored<'a>> {
        let alone = Search { offer: Offer::Rich, dispersion: dispersion(set), ..self.clone() };
        let forms = || each(self.forms_of(set, 0)).filter_map(|(k, item)| self.replaced(set, k, item));
        let (mut richer, more): (Vec<Scored<'a>>, _) =
            rayon::join(|| forms().collect(), || alone.expand(std::slice::from_ref(set)));
        richer.extend(more.into_iter().take(BEAM));
        let share = 1.0 - self.limits.richer;
        let removes = each(richer).filter(|child| self.removes(set, child, share));
        let mut richer: Vec<Scored<'a>> = removes.collect();
        if !richer.is_empty() {
            let validated = cross_validated(set);
            let validates = each(richer).filter(|child| validates(set, validated, child));
            richer = validates.collect();
        }
        richer.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        richer
    }

    /// Whether a set with richer forms replaces the plain one: it leaves clearly less on the log, on the folds that were not fitted
    /// and on every held-out record.
    fn replaces(&self, plain: &Asked<'_, 'a>, rich: &Scored<'a>) -> bool {
        let is_rich = |item: &Item| item.is_full() || self.is_rich(item.effect.form);
        let errors = |set: &Scored| held_out_errors(&set.hypothesis, &set.fit.x);
        rich.hypothesis.items.iter().any(is_rich)
            && rich.fit.cost <= self.limits.richer * plain.set.fit.cost
            && no_more(&errors(rich), plain.held_out(), self.limits.richer)
            && cross_validated(rich) <= self.limits.richer * plain.validated()
    }

    /// The first child, in the order of the log, that removes its share there and that no held-out record refuses. Refused names
    /// are taken out of the offer and out of the round.
    pub(super) fn chosen(&mut self, current: &Scored<'a>, grown: &mut Vec<Scored<'a>>) -> Option<Scored<'a>> {
        let asked = Asked::of(current);
        let mut vetoes = 0;
        let mut place = 0;
        while place < grown.len().min(BEAM + vetoes) {
            let child = self.refit(&grown[place], &SEARCH);
            if !self.removes(current, &child, self.limits.joins)
                || !validates(current, asked.validated(), &child)
            {
                place += 1;
                continue;
            }
            let after = held_out_errors(&child.hypothesis, &child.fit.x);
            let before = asked.held_out();
            let refused = !no_more(&after, before, WORSE) || sum(&after) > sum(before);
            if !refused {
                return Some(child);
            }
            if vetoes == VETOES {
                return None;
            }
            vetoes += 1;
            let name = child.hypothesis.names().pop().expect("a child has a name");
            grown.retain(|other| !other.hypothesis.names().contains(&name));
            self.excluded.push(name);
        }
        None
    }

    /// Whether a larger set removes a share of the squared error on the log, and more than chance.
    fn removes(&self, current: &Scored<'a>, child: &Scored<'a>, share: f64) -> bool {
        let ratio = child.fit.cost / current.fit.cost;
        if ratio > 1.0 - share {
            return false;
        }
        let more = child.hypothesis.effect_slots() as f64 - current.hypothesis.effect_slots() as f64;
        if -ratio.ln() * effective_samples(child) < 2.0 * PER_NUMBER * more.max(1.0) {
            return false;
        }
        self.stands_out(current, child) && self.goes_round(child)
    }

    /// Whether the log saw some whole periods of the newest effect, if its period was looked for: one wave along the whole way is
    /// a shape and no period.
    fn goes_round(&self, child: &Scored<'a>) -> bool {
        let newest = child.hypothesis.items.len() - 1;
        let effect = child.hypothesis.items[newest].effect;
        let value = |meaning: Meaning| {
            let place = effect.place(meaning)?;
            Some(child.hypothesis.value(newest, place, &child.fit.x))
        };
        let periods = match effect.starts {
            Starts::PositionScan => value(Meaning::PeriodsPerTurn)
                .map(|periods| periods * self.dataset.travel() / std::f64::consts::TAU),
            Starts::TimeScan => value(Meaning::Frequency).map(|hertz| hertz * self.dataset.scales.duration),
            _ => None,
        };
        periods.is_none_or(|periods| periods >= PERIODS)
    }

    /// The set by elimination, the weakest name first, and the names that did not stay. As a whole the set must leave less than the
    /// model as given on every held-out record.
    fn retained(&self, scored: Scored<'a>) -> (Scored<'a>, Vec<String>) {
        let mut best = scored;
        let mut dropped = Vec::new();
        while !best.hypothesis.items.is_empty() {
            let (without, worth) = self.weighed(&best);
            let weakest = (0..worth.len())
                .min_by(|a, b| worth[*a].growth.total_cmp(&worth[*b].growth))
                .expect("a set with names");
            let whole_helps = best.hypothesis.items.len() > 1 || self.beats_given(&best);
            if worth[weakest].growth >= self.limits.stays && whole_helps {
                break;
            }
            dropped.push(best.hypothesis.names()[weakest].clone());
            best = without.into_iter().nth(weakest).expect("in range");
        }
        if !best.hypothesis.items.is_empty() && !self.beats_given(&best) {
            let base = self.without_all(&best);
            return (base, dropped);
        }
        (best, dropped)
    }

    /// The set without each of its names, everything else fitted anew, and what each is worth.
    fn weighed(&self, set: &Scored<'a>) -> (Vec<Scored<'a>>, Vec<Worth>) {
        let with = held_out_errors(&set.hypothesis, &set.fit.x);
        let weighed = each(0..set.hypothesis.items.len()).map(|index| {
            let without = self.without(set, index, &SEARCH);
            let worth = Worth::of(set, &with, &without);
            (without, worth)
        });
        weighed.unzip()
    }

    /// The set without the names that hardly lift the held-out fit, the smallest first. Where the noise is reached, it is the measure
    /// and nothing is too small. With what the names that stay are worth, if that was asked.
    fn without_small(&self, scored: Scored<'a>, path: &mut Path<'a>) -> (Scored<'a>, Option<Vec<Worth>>) {
        let mut best = scored;
        while !best.hypothesis.items.is_empty() && !self.at_floor(&best) {
            let (without, worth) = self.weighed(&best);
            let smallest = (0..worth.len()).min_by(|a, b| worth[*a].points.total_cmp(&worth[*b].points));
            let smallest = smallest.expect("a set with names");
            if worth[smallest].points >= self.limits.points {
                return (best, Some(worth));
            }
            path.small.push((best.hypothesis.names()[smallest].clone(), worth[smallest].points));
            best = without.into_iter().nth(smallest).expect("in range");
        }
        (best, None)
    }

    /// The set with the names that remove most in front.
    fn by_weight(&self, scored: Scored<'a>, worth: Option<Vec<Worth>>) -> Scored<'a> {
        let worth = worth.unwrap_or_else(|| self.weighed(&scored).1);
        let mut order: Vec<usize> = (0..worth.len()).collect();
        order.sort_by(|a, b| worth[*b].on_log.total_cmp(&worth[*a].on_log));
        let items = order.into_iter().map(|k| scored.hypothesis.items[k]).collect();
        let hypothesis = scored.hypothesis.with(items);
        let x = hypothesis.carried(&scored.hypothesis, &scored.fit.x, &|_| 0.0);
        self.scored(hypothesis, Fit { x, ..scored.fit })
    }

    fn without_all(&self, scored: &Scored<'a>) -> Scored<'a> {
        let mut bare = scored.clone();
        while !bare.hypothesis.items.is_empty() {
            bare = self.without(&bare, 0, &SEARCH);
        }
        bare
    }

    /// True if a set leaves clearly less than the model as given on every held-out record.
    fn beats_given(&self, scored: &Scored<'a>) -> bool {
        let given = Hypothesis::new(self.dataset, self.model, Vec::new());
        let before = held_out_errors(&given, &vec![0.0; given.slots.len()]);
        let after = held_out_errors(&scored.hypothesis, &scored.fit.x);
        no_more(&after, &before, 1.0) && sum(&after) <= self.limits.against_given * sum(&before)
    }
}

/// Whether a larger set removes a part of its share on the folds that were not fitted, too. `validated`: χ² of the smaller one there.
fn validates(current: &Scored, validated: f64, child: &Scored) -> bool {
    let ratio = child.fit.cost / current.fit.cost;
    cross_validated(child) < (1.0 - VALIDATED * (1.0 - ratio)) * validated
}

/// A set that several others are compared with, and what is only computed when it is asked.
struct Asked<'s, 'a> {
    set: &'s Scored<'a>,
    validated: OnceCell<f64>,
    held_out: OnceCell<Vec<f64>>,
}

impl<'s, 'a> Asked<'s, 'a> {
    fn of(set: &'s Scored<'a>) -> Self {
        Self { set, validated: OnceCell::new(), held_out: OnceCell::new() }
    }

    /// χ² on the folds that were not fitted.
    fn validated(&self) -> f64 {
        *self.validated.get_or_init(|| cross_validated(self.set))
    }

    /// Squared errors of the held-out records.
    fn held_out(&self) -> &[f64] {
        self.held_out.get_or_init(|| held_out_errors(&self.set.hypothesis, &self.set.fit.x))
    }
}

/// What a name of a set is worth.
struct Worth {
    /// By which share the squared error grows without it, on the log or on the held-out records together, whichever is less.
    growth: f64,
    /// The same on the log alone.
    on_log: f64,
    /// By how many points the held-out fit falls without it.
    points: f64,
}

impl Worth {
    /// `with`: errors of the held-out records with the name.
    fn of(set: &Scored, with: &[f64], without: &Scored) -> Self {
        let without_it = held_out_errors(&without.hypothesis, &without.fit.x);
        let log = without.fit.cost / set.fit.cost;
        let ratio = |a: f64, b: f64| a / b.max(f64::MIN_POSITIVE);
        let together = ratio(sum(&without_it), sum(with));
        let least = without_it.iter().zip(with).map(|(a, b)| ratio(*a, *b)).fold(f64::INFINITY, f64::min);
        // A record that the name does not help by a little is no proof of it, however much the others are helped.
        let growth = if least < HELPS_EACH { least - 1.0 } else { log.min(together) - 1.0 };
        let all = held_out_variation(set.hypothesis.dataset).max(f64::MIN_POSITIVE);
        let fit = |errors: &[f64]| 100.0 * (1.0 - (errors.iter().sum::<f64>() / all).sqrt());
        Self { growth, on_log: log - 1.0, points: fit(with) - fit(&without_it) }
    }
}

fn sum(errors: &[f64]) -> f64 {
    errors.iter().sum()
}

/// True if each error is at most `share` of its counterpart.
pub(super) fn no_more(errors: &[f64], than: &[f64], share: f64) -> bool {
    errors.iter().zip(than).all(|(error, than)| *error <= share * than)
}

/// The number of samples, those that tell the same counted once.
fn effective_samples(scored: &Scored) -> f64 {
    let residuals = compared(&scored.hypothesis, &scored.fit.x, &SEARCH);
    scored.fit.samples as f64 / crate::gap::residual::inflation(&residuals)
}
