//! Sentences for people.

use crate::effects::Effect;
use crate::outcome::{Rival, Step, Tie};
use crate::search::Found;

/// Why an effect is named.
pub fn sentence(effect: &Effect, before: &Step, after: &Step) -> String {
    format!(
        "{}: the held-out gap falls from {:.3e} to {:.3e}; its trace is {}",
        effect.summary, before.gap, after.gap, effect.signature
    )
}

/// Explanations that lost, and why.
pub fn rivals(found: &Found, ties: &[Tie]) -> Vec<Rival> {
    let tied: Vec<&Vec<String>> = ties.iter().flat_map(|tie| &tie.rivals).collect();
    let lost = found
        .others
        .iter()
        .filter(|other| !tied.contains(&&other.hypothesis.names()));
    lost.map(|other| Rival {
        names: other.hypothesis.names(),
        gap: crate::gap::Prediction::of(&other.hypothesis, &other.fit.x, &[crate::bench::Part::HoldOut])
            .gap(),
        reason: format!(
            "fits worse: χ² {:.0} against {:.0} of the accepted set",
            other.fit.cost, found.best.fit.cost
        ),
    })
    .collect()
}
