//! Sentences for people.

use crate::effects::Effect;
use crate::outcome::{Rival, Step, Tie};
use crate::report::gap;
use crate::search::Found;

/// Why an effect is named.
pub fn sentence(effect: &Effect, before: &Step, after: &Step, unit: &str) -> String {
    let (from, to) = (gap(before.gap), gap(after.gap));
    format!(
        "The held-out gap falls from {from} to {to} {unit} with it: {}. Its trace: {}.",
        effect.summary, effect.signature
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
