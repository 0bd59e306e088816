//! Sentences for people.

use crate::effects::Effect;
use crate::outcome::{Rival, Step, Tie};
use crate::prediction::Prediction;
use crate::report::gap;
use crate::search::{Found, Scored};

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
        gap: Prediction::of(&other.hypothesis, &other.fit.x, &[crate::bench::Part::HoldOut]).gap(),
        reason: reason(other, &found.best),
    })
    .collect()
}

/// Why a set lost against the accepted one: what it leaves, and the trace of the effect that it has instead.
fn reason(other: &Scored, best: &Scored) -> String {
    let left = |set: &Scored| (set.fit.chi2 / set.fit.samples.max(1) as f64).sqrt();
    let missing = |set: &Scored, from: &Scored| {
        let names = from.hypothesis.names();
        set.hypothesis
            .items
            .iter()
            .map(|item| item.effect)
            .find(|effect| !names.iter().any(|name| name == effect.name))
    };
    let mut text = format!(
        "leaves {:.2} times the noise where the accepted set leaves {:.2} (χ² {:.0} higher)",
        left(other),
        left(best),
        other.fit.cost - best.fit.cost
    );
    if let Some(effect) = missing(best, other) {
        text.push_str(&format!(
            "; without {} this trace stays unexplained: {}",
            effect.name, effect.signature
        ));
    }
    text
}
