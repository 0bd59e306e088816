//! Sets that come near the accepted one.

use super::Search;
use crate::gap::acceptance::{self, residual_share::near};
use crate::gap::fit::hypothesis::{Hypothesis, Item};
use crate::gap::fit::scored::{Scored, dispersion};
use crate::gap::order::by_least;
use crate::system::effects::Family;
use crate::system::threads::of_each;

/// Sets within so many times the limit of a tie are fitted on the fine grid, which then decides. Chosen by judgement;
/// not studied.
const NEAR: f64 = 5.0;

impl<'a> Search<'a, '_> {
    /// Sets of the same size as the best that come near, finely fitted, best first.
    pub(super) fn rivals(
        &self,
        best: &Scored<'a>,
        others: Vec<Scored<'a>>,
        singles: &[Scored<'a>],
    ) -> Vec<Scored<'a>> {
        let size = best.hypothesis.items.len();
        let pool = others.into_iter().chain(singles.iter().cloned());
        let mut near: Vec<Scored<'a>> = Vec::new();
        for other in pool.filter(|other| other.hypothesis.items.len() == size && size > 0) {
            let names = sorted_names(&other);
            if !same_family_set(&other.hypothesis, &best.hypothesis)
                && !near.iter().any(|known| sorted_names(known) == names)
            {
                near.push(other);
            }
        }
        by_least(&mut near, |it| it.score);
        let margin = NEAR * acceptance::tied(dispersion(best));
        near.retain(|other| other.fit.cost - best.fit.cost < margin);
        near.truncate(6);
        let mut fine = of_each(&near, |other| self.fine(other));
        by_least(&mut fine, |it| it.score);
        fine
    }
}

/// True if two sets differ only by richer or poorer forms of the same families: then the score has decided.
fn same_family_set(a: &Hypothesis, b: &Hypothesis) -> bool {
    let key = |item: &Item| match item.effect.family {
        Family::Own => item.effect.name.to_owned(),
        shared => format!("{shared:?}"),
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

/// Where the gap is measured by shares, sets that leave this much more of the squared error, on the log or on a
/// held-out record, are no tie. Chosen by judgement; not studied.
const TIED_SHARE: f64 = 0.1;

/// Sets that the data cannot tell from the best.
pub fn tied<'s, 'a>(best: &Scored<'a>, others: &'s [Scored<'a>]) -> Vec<&'s Scored<'a>> {
    let margin = acceptance::tied(dispersion(best));
    let alike = best.hypothesis.model.by_shares.then(|| near(best, 1.0 + TIED_SHARE, 1.0 + TIED_SHARE));
    let tied = |other: &&Scored| {
        other.fit.cost - best.fit.cost < margin && alike.as_ref().is_none_or(|alike| alike(other))
    };
    others.iter().filter(tied).collect()
}
