//! Effects of a set are replaced by others, and dropped.

use super::Search;
use super::race::{THIRD_ROUND, looked_at};
use crate::gap::acceptance::noise::{FineNoise, inside_tolerance};
use crate::gap::acceptance::{Others, decided, price};
use crate::gap::fit::hypothesis::Item;
use crate::gap::fit::scored::{Scored, dispersion, score_with};
use crate::gap::fit::{FINAL, SEARCH};
use crate::system::effects::LIBRARY;
use crate::system::threads::*;

/// Candidates that are fitted in each exchange of one accepted effect for another: twice as many as a round fits to
/// the end. A budget of computing time, chosen by judgement.
const EXCHANGE_ROUND: usize = 2 * THIRD_ROUND;
/// Exchanges at most: most searches end after none or one. A budget of computing time, chosen by judgement.
const EXCHANGES: usize = 3;

impl<'a> Search<'a, '_> {
    /// Replaces one effect of a set at a time by any other, as long as that helps: a first name that explained much of two
    /// effects together is not dropped by elimination alone. The sets that lost are the rivals.
    pub(super) fn exchanged(&self, scored: Scored<'a>) -> (Scored<'a>, Vec<Scored<'a>>) {
        let (mut best, mut lost) = (scored, Vec::new());
        for _ in 0..EXCHANGES {
            if best.hypothesis.items.len() < 2 {
                break;
            }
            let places = each(0..best.hypothesis.items.len());
            let others = places.flat_map_iter(|index| self.instead(&best, index));
            lost.extend(others.collect::<Vec<Scored<'a>>>());
            let factor = dispersion(&best);
            let better = |child: &&Scored<'a>| {
                child.hypothesis.items.len() == best.hypothesis.items.len()
                    && score_with(child, factor) + price(factor) < score_with(&best, factor)
                    && inside_tolerance(child).is_none()
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

    /// The set with others in the place of one effect, best first; none if the rounds have already tried them all.
    fn instead(&self, set: &Scored<'a>, index: usize) -> Vec<Scored<'a>> {
        if self.was_expanded(set, index) {
            return Vec::new();
        }
        let parents = [self.without(set, index, &SEARCH)];
        let (basis, projector) = looked_at(&parents[0]);
        let left_out = set.hypothesis.items[index].effect;
        let others = LIBRARY.iter().copied().filter(|effect| *effect != left_out);
        let tasks = others.filter(|effect| self.offers(&parents[0], effect)).map(|effect| (0, effect));
        self.fitted(&parents, &[basis], &[projector], tasks.collect(), EXCHANGE_ROUND)
    }

    /// True if the rounds have already tried all other effects in the place of one.
    fn was_expanded(&self, scored: &Scored, index: usize) -> bool {
        let mut left = scored.hypothesis.items.clone();
        left.remove(index);
        let same = |items: &Vec<Item>| items.len() == left.len() && left.iter().all(|it| items.contains(it));
        self.expanded.iter().any(same)
    }

    /// Drops every effect whose removal costs too little, on the fine grid.
    pub(super) fn eliminated(&self, scored: Scored<'a>) -> Scored<'a> {
        let mut best = scored;
        while best.hypothesis.items.len() > 1 {
            let noise = FineNoise { dispersion: dispersion(&best) };
            let smaller = of_each(0..best.hypothesis.items.len(), |k| self.without(&best, k, &FINAL));
            match decided(&noise, &best, Others::Smaller, smaller) {
                Some((fewer, _)) => best = fewer,
                None => break,
            }
        }
        best
    }
}
