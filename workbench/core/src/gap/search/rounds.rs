//! The rounds of the beam over a record, whether its gap is measured by the noise or by shares.

use super::{Offer, Search};
use crate::gap::acceptance::noise::{Noise, at_floor, inside_tolerance};
use crate::gap::acceptance::{Others, decided};
use crate::gap::beam::{Growth, grown};
use crate::gap::fit::SEARCH;
use crate::gap::fit::scored::{Scored, dispersion};
use crate::outcome::Small;

/// Sets that are grown side by side: two effects that help only together need a second one. A budget of computing
/// time, chosen by judgement; the third costs half as much again.
pub(super) const BEAM: usize = 3;
/// Sets of a round that lost and may be told as rivals. Chosen by judgement; not studied.
const RIVALS: usize = 12;
/// Part of the cost by which the best child must be lower for a round without a winner to be half of a pair. Chosen
/// by judgement; not studied.
const HALF_OF_A_PAIR: f64 = 0.05;
/// The same where the gap is measured by shares, as a part of the share that a name must remove. Chosen by judgement;
/// not studied.
const HALF_OF_A_SHARE: f64 = 0.3;

/// What the rounds leave for the report.
#[derive(Default)]
pub(super) struct Path<'a> {
    /// All singles of the first round, best first.
    pub singles: Vec<Scored<'a>>,
    /// Sets that lost.
    pub others: Vec<Scored<'a>>,
    /// Names that were tried together and did not all stay.
    pub dropped: Vec<String>,
    /// Names that would have stayed but for what they are worth, with the points of held-out fit that they bring.
    pub small: Vec<Small>,
}

impl<'a> Search<'a, '_> {
    /// Adds names until none pays for itself.
    pub(super) fn grown(&mut self, from: Scored<'a>, path: &mut Path<'a>) -> Scored<'a> {
        let effects = from.hypothesis.items.len();
        grown(&mut Rounds { search: self, path }, from, effects)
    }

    /// A set without its effects that stay inside their tolerance: what was named for want of a better may be put right by the
    /// newest effect.
    fn pruned(&self, child: &Scored<'a>) -> Scored<'a> {
        let mut best = child.clone();
        while let Some(index) = inside_tolerance(&best) {
            best = self.without(&best, index, &SEARCH);
        }
        best
    }
}

struct Rounds<'s, 'a, 'p> {
    search: &'s mut Search<'a, 'p>,
    path: &'s mut Path<'a>,
}

impl<'a> Growth for Rounds<'_, 'a, '_> {
    type Set = Scored<'a>;

    fn width(&self) -> usize {
        BEAM
    }

    fn children(&mut self, round: usize, current: &Scored<'a>, beam: &[Scored<'a>]) -> Vec<Scored<'a>> {
        (self.search.progress)(&format!("round {round}: {}", current.label()));
        // At the floor nothing is left that another one and a half of a pair could explain together.
        let floor = self.search.offer == Offer::All && at_floor(current);
        let beam = if floor { &beam[..1] } else { beam };
        let children = self.search.expand(beam);
        self.search.expanded.extend(beam.iter().map(|parent| parent.hypothesis.items.clone()));
        if self.path.singles.is_empty() {
            self.path.singles = children.clone();
        }
        children
    }

    fn winner(&mut self, current: &Scored<'a>, children: &mut Vec<Scored<'a>>) -> Option<Scored<'a>> {
        if self.search.offer != Offer::All {
            return self.search.chosen(current, children);
        }
        let noise = Noise::new(self.search.first_gap);
        let best = children.iter().take(BEAM).map(|child| self.search.pruned(child));
        decided(&noise, current, Others::Larger, best).map(|(winner, _)| winner)
    }

    fn accepted(&mut self, _: &Scored<'a>, winner: Scored<'a>, grown: Vec<Scored<'a>>) -> (Scored<'a>, bool) {
        let names = winner.hypothesis.names();
        let others = grown.into_iter().filter(|child| child.hypothesis.names() != names);
        self.path.others = others.take(RIVALS).collect();
        self.search.dispersion = dispersion(&winner);
        let settled = self.search.settled(winner);
        let richer = matches!(self.search.offer, Offer::All | Offer::Forms);
        let refined = if richer { self.search.refined(settled) } else { settled };
        (refined, true)
    }

    fn may_pair(&mut self, current: &Scored<'a>, children: Vec<Scored<'a>>) -> bool {
        let lower = |child: &Scored<'a>, part: f64| child.fit.cost < (1.0 - part) * current.fit.cost;
        children.first().is_some_and(|child| match self.search.offer {
            Offer::All => lower(child, HALF_OF_A_PAIR) && !at_floor(current),
            _ => lower(child, HALF_OF_A_SHARE * self.search.limits.joins),
        })
    }
}
