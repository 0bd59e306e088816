//! Sentences for people.

use crate::gap::search::{Found, Scored};
use crate::outcome::{Rival, Tie};
use crate::system::threads::of_each;

/// Explanations that lost, and why.
pub fn rivals(found: &Found, ties: &[Tie], gap_of: impl Fn(&Scored) -> f64 + Sync) -> Vec<Rival> {
    let tied: Vec<&Vec<String>> = ties.iter().flat_map(|tie| &tie.rivals).collect();
    let lost = found.others.iter().filter(|other| !tied.contains(&&other.hypothesis.names()));
    let rival = |other: &Scored| Rival {
        names: other.hypothesis.names(),
        gap: gap_of(other),
        reason: reason(other, &found.best),
    };
    of_each(lost.collect::<Vec<_>>(), rival)
}

/// Why a set lost against the accepted one: what it leaves, and the trace of the effect that it has instead.
fn reason(other: &Scored, best: &Scored) -> String {
    let left = |set: &Scored| (set.fit.chi2 / set.fit.samples.max(1) as f64).sqrt();
    let missing = |set: &Scored, from: &Scored| {
        let has = |effect: &crate::system::effects::Effect| {
            from.hypothesis.items.iter().any(|item| item.effect == effect)
        };
        let effects = set.hypothesis.items.iter().map(|item| item.effect);
        effects.into_iter().find(|effect| !has(effect))
    };
    let mut text =
        format!("leaves {:.2} times the noise where the accepted set leaves {:.2}", left(other), left(best));
    if let Some(effect) = missing(best, other) {
        text.push_str(&format!("; without {} this stays unexplained: {}", effect.name, effect.signature));
    }
    text
}
