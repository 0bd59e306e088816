//! The search where no set reaches the noise, as on a real rig: names are accepted by
//! [shares](crate::gap::acceptance::residual_share).
//!
//! ```text
//! plain forms: round → share of the log → veto … → elimination → richer forms, if they remove a share more → rivals
//! ```

use super::rounds::{BEAM, Path};
use super::{Found, Offer, Search};
use crate::gap::acceptance::noise::{at_floor, cross_validated};
use crate::gap::acceptance::residual_share::{Joining, Measure, Staying, agreed, near, no_more, sum};
use crate::gap::acceptance::{Others, decided};
use crate::gap::fit::SEARCH;
use crate::gap::fit::hypothesis::Item;
use crate::gap::fit::scored::{Scored, dispersion};
use crate::gap::order::by_least;
use crate::outcome::Small;
use crate::system::effects::{Effect, QUADRATIC_DRAG};
use crate::system::threads::*;
use std::cell::OnceCell;

/// Richer forms that one after the other may join. Chosen by judgement; not studied.
const RICHER_FORMS: usize = 2;
/// A set that leaves more than this part of the first gap (squared) may be the wrong one: all forms are then searched
/// from the beginning. Chosen by judgement; not studied.
const MUCH: f64 = 0.1;
/// Names that the held-out records may refuse in one round. A budget of computing time, chosen by judgement.
const VETOES: usize = 3;
/// Searches that go on because a name of the whole set did not stay. A budget of computing time, chosen by judgement.
const AGAIN: usize = 3;

impl<'a> Search<'a, '_> {
    /// The whole search, by shares.
    pub(super) fn by_shares(self, base: Scored<'a>) -> Found<'a> {
        let mut path = Path::default();
        let plain = self.searched(Offer::Plain, &base, &mut path);
        let mut kept = self.enriched(plain.clone(), &mut path);
        if kept.hypothesis.items != plain.hypothesis.items && !at_floor(&kept) {
            // Names that had to wait for the richer form.
            let more = self.searched(Offer::Plain, &kept, &mut path);
            kept = if more.hypothesis.items.len() > kept.hypothesis.items.len() { more } else { kept };
        }
        if kept.fit.chi2 > MUCH * self.first_gap && !at_floor(&kept) {
            let anew = self.searched(Offer::Forms, &base, &mut path);
            if self.leaves_less(&kept)(&anew) {
                path.others.push(std::mem::replace(&mut kept, anew));
            }
        }
        self.weeded(&base, kept, path)
    }

    /// What is left of a set when conventions, doubles and small names are through.
    fn weeded(&self, base: &Scored<'a>, kept: Scored<'a>, mut path: Path<'a>) -> Found<'a> {
        let kept = self.by_convention(kept, &mut path);
        let kept = self.one_friction(kept, &mut path);
        let kept = self.one_name_for_two(kept, &mut path);
        let small = path.small.len();
        let (mut kept, mut smaller) = self.without_small(kept, &mut path);
        if path.small.len() > small {
            // A small name may have stood in the place of a richer form.
            (kept, smaller) = (self.enriched(kept, &mut path), None);
        }
        self.found(base, self.evened(self.fine(&self.by_weight(kept, smaller))), path)
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
            let (left, dropped) = search.retained(grown);
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
            let Some(winner) = search.richer_instead(&best) else {
                break;
            };
            path.others.push(std::mem::replace(&mut best, winner));
        }
        best
    }

    /// The first of the richer sets that removes a share more and replaces a set, with what of it stays.
    fn richer_instead(&self, set: &Scored<'a>) -> Option<Scored<'a>> {
        let replaces = self.replaced_by(set);
        let joining = Joining::new(1.0 - self.limits.richer);
        let richer = self.richer(set).into_iter().filter(&replaces);
        let (winner, _) = decided(&joining, set, Others::Larger, richer)?;
        Some(self.retained(self.refit(&winner, &SEARCH)).0).filter(&replaces)
    }

    /// The richer forms of each effect of a set, and the set with one rich effect more, best first.
    fn richer(&self, set: &Scored<'a>) -> Vec<Scored<'a>> {
        let alone = Search { offer: Offer::Rich, dispersion: dispersion(set), ..self.clone() };
        let forms = || each(self.forms_of(set, 0)).filter_map(|(k, item)| self.replaced(set, k, item));
        let (mut richer, more): (Vec<Scored<'a>>, _) =
            join(|| forms().collect(), || alone.expand(std::slice::from_ref(set)));
        richer.extend(more.into_iter().take(BEAM));
        by_least(&mut richer, |it| it.fit.cost);
        richer
    }

    /// Whether a set with richer forms replaces the plain one.
    fn replaced_by(&self, plain: &Scored<'a>) -> impl Fn(&Scored<'a>) -> bool {
        let less = self.leaves_less(plain);
        let is_rich = |item: &Item| item.is_full() || self.is_rich(item.effect.form);
        move |rich| rich.hypothesis.items.iter().any(is_rich) && less(rich)
    }

    /// Whether another set leaves clearly less on the log, on the folds that were not fitted and on every held-out record.
    fn leaves_less(&self, standing: &Scored<'a>) -> impl Fn(&Scored<'a>) -> bool + use<'a> {
        let richer = self.limits.richer;
        let (near, standing) = (near(standing, richer, richer), standing.clone());
        let validated = OnceCell::new();
        move |other| {
            near(other)
                && cross_validated(other) <= richer * *validated.get_or_init(|| cross_validated(&standing))
        }
    }

    /// The first child, in the order of the log, that removes its share there and that no held-out record refuses. Refused names
    /// are taken out of the offer and out of the round.
    pub(super) fn chosen(&mut self, current: &Scored<'a>, grown: &mut Vec<Scored<'a>>) -> Option<Scored<'a>> {
        let joining = Joining::new(self.limits.joins);
        let before = OnceCell::new();
        let (mut place, mut vetoes) = (0, 0);
        loop {
            let end = grown.len().min(BEAM + vetoes);
            let mut tried = place;
            let children = grown.iter().take(end).skip(place).inspect(|_| tried += 1);
            let children = children.map(|child| self.refit(child, &SEARCH));
            let (child, _) = decided(&joining, current, Others::Larger, children)?;
            let earned = current.hypothesis.items.is_empty()
                || !fills(child.hypothesis.items.last()?.effect)
                || self.earns_as_filler(current, &child);
            if earned && agreed(before.get_or_init(|| current.held_out()), &child) {
                return Some(child);
            }
            if vetoes == VETOES {
                return None;
            }
            (place, vetoes) = (tried - 1, vetoes + 1);
            let name = child.hypothesis.names().pop().expect("a child has a name");
            grown.retain(|other| !other.hypothesis.names().contains(&name));
            self.excluded.push(name);
        }
    }

    /// Whether what takes up a part of any remainder may join: it must leave what a richer form must, and less than the richer forms of
    /// what is there.
    fn earns_as_filler(&self, current: &Scored<'a>, child: &Scored<'a>) -> bool {
        let less = self.leaves_less(current);
        // The round of the plain forms does not offer them.
        let forms = Search { offer: Offer::Forms, ..self.clone() };
        let lost = |rich: &Scored<'a>| rich.fit.cost > child.fit.cost || !less(rich);
        less(child) && forms.richer(current).first().is_none_or(lost)
    }

    /// The set by elimination, the weakest name first, and the names that did not stay. As a whole the set must leave less than the
    /// model as given on every held-out record: where only names that hardly stay do that together, they stay together.
    fn retained(&self, scored: Scored<'a>) -> (Scored<'a>, Vec<String>) {
        let mut dropped = scored.hypothesis.names();
        let (mut best, mut kept) = (scored, None);
        while !best.hypothesis.items.is_empty() {
            let staying = Staying::new(&best, Measure::Growth, self.limits.stays);
            let left = decided(&staying, &best, Others::Smaller, self.smaller(&best));
            let nearly = left.as_ref().is_none_or(|(_, growth)| *growth >= self.limits.joins);
            if nearly && self.beats_given(&best) {
                kept = Some(best.clone());
            }
            let Some((fewer, _)) = left else { break };
            best = fewer;
        }
        let bare = kept.is_none();
        let mut best = kept.unwrap_or(best);
        while bare && !best.hypothesis.items.is_empty() {
            best = self.without(&best, 0, &SEARCH);
        }
        let names = best.hypothesis.names();
        dropped.retain(|name| !names.contains(name));
        (best, dropped)
    }

    /// The set without each of its names, everything else fitted anew.
    fn smaller(&self, set: &Scored<'a>) -> Vec<Scored<'a>> {
        of_each(0..set.hypothesis.items.len(), |index| self.without(set, index, &SEARCH))
    }

    /// The set without the names that hardly lift the held-out fit, the smallest first. Where the noise is reached, it is the measure
    /// and nothing is too small. With the sets without each name that stays, if they were asked for.
    fn without_small(
        &self,
        scored: Scored<'a>,
        path: &mut Path<'a>,
    ) -> (Scored<'a>, Option<Vec<Scored<'a>>>) {
        let mut best = scored;
        while !best.hypothesis.items.is_empty() && !at_floor(&best) {
            let staying = Staying::new(&best, Measure::Points, self.limits.points);
            let smaller = self.smaller(&best);
            let Some((fewer, points)) = decided(&staying, &best, Others::Smaller, smaller.iter().cloned())
            else {
                return (best, Some(smaller));
            };
            let left = fewer.hypothesis.names();
            let gone = best.hypothesis.names().into_iter().find(|name| !left.contains(name));
            path.small.extend(gone.map(|name| Small { name, fit_points: points }));
            best = fewer;
        }
        (best, None)
    }

    /// The set with the names that remove most in front. `smaller`: it without each of its names.
    fn by_weight(&self, scored: Scored<'a>, smaller: Option<Vec<Scored<'a>>>) -> Scored<'a> {
        let smaller = smaller.unwrap_or_else(|| self.smaller(&scored));
        let mut order: Vec<usize> = (0..smaller.len()).collect();
        order.sort_by(|a, b| smaller[*b].fit.cost.total_cmp(&smaller[*a].fit.cost));
        let items = order.into_iter().map(|k| scored.hypothesis.items[k]).collect();
        scored.arranged(items)
    }

    /// True if a set leaves clearly less than the model as given on every held-out record.
    fn beats_given(&self, scored: &Scored<'a>) -> bool {
        let before = Scored::given(self.dataset, self.model).held_out();
        let after = scored.held_out();
        no_more(&after, &before, 1.0) && sum(&after) <= self.limits.against_given * sum(&before)
    }
}

/// Effects that take up a part of whatever is left: as later names they must earn what a richer form earns.
fn fills(effect: &Effect) -> bool {
    effect.starts.scans() || *effect == QUADRATIC_DRAG
}
