//! Names that explain nearly the same where a model is itself a fit to the log: which of them is said.

use super::rounds::Path;
use super::{Offer, Search};
use crate::gap::acceptance::residual_share::near;
use crate::gap::fit::SEARCH;
use crate::gap::fit::hypothesis::Item;
use crate::gap::fit::scored::Scored;
use crate::system::effects::{Effect, Family, LAGS, PLAIN_FRICTIONS, RARE_LAG, SHIFTS};
use crate::system::threads::*;

/// Two descriptions leave the same if one leaves at most so many times the squared error of the other. Chosen by
/// judgement; not studied.
const THE_SAME: f64 = 1.02;

impl<'a> Search<'a, '_> {
    /// Of names that explain nearly the same, the one that is far more common is said, and the other stays as a rival.
    ///
    /// - A lag of the drive gives way to a lag or delay of the measured speed unless it removes what a name must: a quarter more.
    /// - A shift of the whole motion gives way to a friction or a dead zone that predicts the held-out records as well: records of single
    ///   levels, or of one direction, hardly tell them apart, and every drive has friction.
    pub(super) fn by_convention(&self, scored: Scored<'a>, path: &mut Path<'a>) -> Scored<'a> {
        let rubs = place(&scored, is_friction).is_some();
        let scored = match place(&scored, |effect| *effect == *RARE_LAG) {
            Some(lag) => self.common_instead(scored, lag, &LAGS, 1.0 + self.limits.stays, path),
            None => scored,
        };
        match place(&scored, |effect| SHIFTS.contains(&effect)).filter(|_| !rubs) {
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
        let likely = common
            .iter()
            .copied()
            .filter(|effect| !self.excludes(effect) && place(&scored, |other| other == *effect).is_none())
            .filter_map(|effect| self.replaced(&scored, index, Item::plain(effect)))
            .map(|other| self.refit(&other, &SEARCH))
            .filter(near(&scored, 1.0 + self.limits.stays, held_out_share))
            .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        instead(scored, likely, path)
    }

    /// A dead zone of the drive and a dry friction of the shaft look alike, and one of them in a richer form stands in for both: one name is
    /// said unless the other removes what a name must. It stays as a rival.
    pub(super) fn one_friction(&self, scored: Scored<'a>, path: &mut Path<'a>) -> Scored<'a> {
        let of = |family: Family| place(&scored, |effect| effect.family == family);
        let (Some(zone), Some(friction)) = (of(Family::DeadZone), of(Family::DryFriction)) else {
            return scored;
        };
        let search = Search { offer: Offer::Forms, ..self.clone() };
        let alone: Vec<Scored<'a>> = each([zone, friction])
            .flat_map_iter(|index| {
                let single = search.without(&scored, index, &SEARCH);
                let left = place(&single, is_friction).expect("the other one");
                let forms = search.variants(&single.hypothesis, left).into_iter();
                let forms = forms.filter_map(|item| search.replaced(&single, left, item));
                let mut forms: Vec<Scored<'a>> = forms.map(|other| search.refit(&other, &SEARCH)).collect();
                forms.push(single);
                forms
            })
            .collect();
        let near = near(&scored, 1.0 + self.limits.stays, 1.0 + self.limits.stays);
        let single = alone.into_iter().filter(near).min_by(|a, b| a.score.total_cmp(&b.score));
        instead(scored, single, path)
    }

    /// A symmetric form and a shift to one side are the same as the form with two sides: where both leave the same, one name is
    /// said instead of two.
    pub(super) fn one_name_for_two(&self, scored: Scored<'a>, path: &mut Path<'a>) -> Scored<'a> {
        let Some(shift) = SHIFTS.iter().find_map(|shift| place(&scored, |effect| effect == *shift)) else {
            return scored;
        };
        let search = Search { offer: Offer::Forms, ..self.clone() };
        let others = self.without(&scored, shift, &SEARCH);
        let two_sided = search.forms_of(&others, 0).into_iter();
        let (near, size) = (near(&scored, THE_SAME, THE_SAME), scored.hypothesis.effect_slots());
        let found = two_sided
            .filter_map(|(index, item)| search.replaced(&others, index, item))
            .map(|other| self.refit(&other, &SEARCH))
            .find(|other| other.hypothesis.effect_slots() <= size && near(other));
        instead(scored, found, path)
    }
}

/// The place of the first effect of a set that is such a one.
fn place(scored: &Scored, such: impl Fn(&Effect) -> bool) -> Option<usize> {
    scored.hypothesis.items.iter().position(|item| such(item.effect))
}

/// The other set, if there is one; the first stays as a rival.
fn instead<'a>(scored: Scored<'a>, other: Option<Scored<'a>>, path: &mut Path<'a>) -> Scored<'a> {
    match other {
        Some(other) => {
            path.others.push(scored);
            other
        }
        None => scored,
    }
}

/// True for what resists the motion at any speed.
fn is_friction(effect: &Effect) -> bool {
    matches!(effect.family, Family::DeadZone | Family::DryFriction)
}
