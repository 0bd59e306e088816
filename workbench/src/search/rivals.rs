//! Sets that come near the accepted one.

use super::Search;
use super::score::{Scored, dispersion};
use crate::effects::Family;
use crate::hypothesis::{Hypothesis, Item};
use rayon::prelude::*;

/// Sets closer than this, times the same factors, are a tie.
const TIED: f64 = 10.0;

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
