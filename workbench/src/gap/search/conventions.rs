//! Names that explain nearly the same where a model is itself a fit to the log: which of them is said.

use super::rounds::Path;
use super::score::Scored;
use super::shares::no_more;
use super::{Offer, Search};
use crate::gap::fit::SEARCH;
use crate::gap::hypothesis::Item;
use crate::gap::prediction::held_out_errors;
use crate::system::effects::{Effect, Family, LAGS, PLAIN_FRICTIONS, RARE_LAG, SHIFTS};
use rayon::prelude::*;

/// Two descriptions leave the same if one leaves at most so many times the squared error of the other.
const THE_SAME: f64 = 1.02;

impl<'a> Search<'a, '_> {
    /// Of names that explain nearly the same, the one that is far more common is said, and the other stays as a rival.
    ///
    /// - A lag of the drive gives way to a lag or delay of the measured speed unless it removes what a name must: a quarter more.
    /// - A shift of the whole motion gives way to a friction or a dead zone that predicts the held-out records as well: records of single
    ///   levels, or of one direction, hardly tell them apart, and every drive has friction.
    pub(super) fn by_convention(&self, scored: Scored<'a>, path: &mut Path<'a>) -> Scored<'a> {
        let place =
            |rare: &[&Effect]| scored.hypothesis.items.iter().position(|item| rare.contains(&item.effect));
        let rubs = scored.hypothesis.items.iter().any(|item| is_friction(item.effect));
        let scored = match place(&[RARE_LAG]) {
            Some(lag) => self.common_instead(scored, lag, &LAGS, 1.0 + self.limits.stays, path),
            None => scored,
        };
        let place =
            |rare: &[&Effect]| scored.hypothesis.items.iter().position(|item| rare.contains(&item.effect));
        match place(&SHIFTS).filter(|_| !rubs) {
            Some(shift) => self.common_instead(scored, shift, &PLAIN_FRICTIONS, THE_SAME, path),
            None => scored,
        }
    }

    /// The set with a common effect in the place of a rare one, if it leaves at most a quarter more on the log and so many times as much on
    /// every held-out record.
    fn common_instead(
        &self,
        scored: Scored<'a>,
        index: usize,
        common: &[&'static Effect],
        held_out_share: f64,
        path: &mut Path<'a>,
    ) -> Scored<'a> {
        let names = scored.hypothesis.names();
        let held_out = held_out_errors(&scored.hypothesis, &scored.fit.x);
        let near = |other: &Scored<'a>| {
            let errors = held_out_errors(&other.hypothesis, &other.fit.x);
            other.fit.cost < (1.0 + self.limits.stays) * scored.fit.cost
                && no_more(&errors, &held_out, held_out_share)
        };
        let likely = common
            .iter()
            .copied()
            .filter(|effect| !self.excluded.iter().chain(&names).any(|name| name == effect.name))
            .filter_map(|effect| self.replaced(&scored, index, Item::plain(effect)))
            .map(|other| self.refit(&other, &SEARCH))
            .filter(near)
            .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        match likely {
            Some(likely) => {
                path.others.push(scored);
                likely
            }
            None => scored,
        }
    }

    /// A dead zone of the drive and a dry friction of the shaft look alike, and one of them in a richer form stands in for both: one name is
    /// said unless the other removes what a name must. It stays as a rival.
    pub(super) fn one_friction(&self, scored: Scored<'a>, path: &mut Path<'a>) -> Scored<'a> {
        let place =
            |family: Family| scored.hypothesis.items.iter().position(|item| item.effect.family == family);
        let (Some(zone), Some(friction)) = (place(Family::DeadZone), place(Family::DryFriction)) else {
            return scored;
        };
        let search = Search { offer: Offer::Forms, ..self.clone() };
        let held_out = held_out_errors(&scored.hypothesis, &scored.fit.x);
        let near = |other: &Scored<'a>| {
            let errors = held_out_errors(&other.hypothesis, &other.fit.x);
            other.fit.cost < (1.0 + self.limits.stays) * scored.fit.cost
                && no_more(&errors, &held_out, 1.0 + self.limits.stays)
        };
        let alone: Vec<Scored<'a>> = [zone, friction]
            .into_par_iter()
            .with_max_len(1)
            .flat_map_iter(|index| {
                let single = search.without(&scored, index, &SEARCH);
                let left =
                    single.hypothesis.items.iter().position(|item| {
                        matches!(item.effect.family, Family::DeadZone | Family::DryFriction)
                    });
                let left = left.expect("the other one");
                let forms = search.variants(&single.hypothesis, left);
                let forms: Vec<Scored<'a>> = forms
                    .into_iter()
                    .filter_map(|item| search.replaced(&single, left, item))
                    .map(|other| search.refit(&other, &SEARCH))
                    .collect();
                forms.into_iter().chain([single])
            })
            .collect();
        match alone.into_iter().filter(near).min_by(|a, b| a.score.total_cmp(&b.score)) {
            Some(single) => {
                path.others.push(scored);
                single
            }
            None => scored,
        }
    }

    /// A symmetric form and a shift to one side are the same as the form with two sides: where both leave the same, one name is
    /// said instead of two.
    pub(super) fn one_name_for_two(&self, scored: Scored<'a>, path: &mut Path<'a>) -> Scored<'a> {
        let items = &scored.hypothesis.items;
        let Some(shift) = SHIFTS.iter().find_map(|shift| items.iter().position(|item| item.effect == *shift))
        else {
            return scored;
        };
        let search = Search { offer: Offer::Forms, ..self.clone() };
        let held_out = held_out_errors(&scored.hypothesis, &scored.fit.x);
        let rest = self.without(&scored, shift, &SEARCH);
        let two_sided = (0..rest.hypothesis.items.len()).flat_map(|index| {
            let variants = search.variants(&rest.hypothesis, index);
            variants.into_iter().map(move |item| (index, item))
        });
        let same = |other: &Scored<'a>| {
            let errors = held_out_errors(&other.hypothesis, &other.fit.x);
            other.hypothesis.effect_slots() <= scored.hypothesis.effect_slots()
                && other.fit.cost <= THE_SAME * scored.fit.cost
                && no_more(&errors, &held_out, THE_SAME)
        };
        let found = two_sided
            .filter_map(|(index, item)| search.replaced(&rest, index, item))
            .map(|other| self.refit(&other, &SEARCH))
            .find(same);
        match found {
            Some(found) => {
                path.others.push(scored);
                found
            }
            None => scored,
        }
    }
}

/// True for what resists the motion at any speed.
fn is_friction(effect: &Effect) -> bool {
    matches!(effect.family, Family::DeadZone | Family::DryFriction)
}
