//! Effects that a unit did not have at first.

use crate::moment::Moment;
use crate::store::{Kept, Told};
use serde::Serialize;
use std::collections::BTreeSet;

/// An effect that appeared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Appeared {
    /// The unit.
    pub unit: String,
    /// The effect.
    pub effect: String,
    /// When the first log that shows it was taken.
    pub at: Moment,
    /// Names that the log before had and this one does not: the effect may be one of them by another name.
    pub instead_of: Vec<String>,
    /// SHA-256 of the last log without it.
    pub last_without: String,
    /// SHA-256 of the logs that show it.
    pub logs: Vec<String>,
    /// Judged logs from then on.
    pub of_logs: usize,
    /// True if at least two logs show it, and more than half of those from then on.
    pub confirmed: bool,
}

/// What appeared on a unit: names that stand in none of the sets, and in no rival of them, before.
pub fn of_unit(unit: &str, results: &[Kept]) -> Vec<Appeared> {
    let judged: Vec<&Kept> = results.iter().filter(|kept| kept.outcome.judged()).collect();
    let mut known = BTreeSet::<&str>::new();
    let mut found = Vec::new();
    for (k, kept) in judged.iter().enumerate() {
        let new = kept
            .outcome
            .effects
            .iter()
            .map(|effect| effect.name.as_str())
            .filter(|name| !known.contains(name));
        found.extend(new.filter(|_| k > 0).map(|name| appeared(unit, name, &judged, k)));
        known.extend(possible(&kept.outcome));
    }
    found
}

fn appeared(unit: &str, effect: &str, judged: &[&Kept], first: usize) -> Appeared {
    let (before, from) = (judged[first - 1], &judged[first..]);
    let gone = before.outcome.names().into_iter().filter(|name| !from[0].outcome.names().contains(name));
    let shows = from.iter().filter(|kept| kept.outcome.names().contains(&effect));
    let logs: Vec<String> = shows.map(|kept| kept.key.log.clone()).collect();
    Appeared {
        unit: unit.into(),
        effect: effect.into(),
        at: from[0].key.at,
        instead_of: gone.map(str::to_owned).collect(),
        last_without: before.key.log.clone(),
        confirmed: logs.len() >= 2 && 2 * logs.len() > from.len(),
        logs,
        of_logs: from.len(),
    }
}

/// The names of a log, and those that it cannot tell from them.
fn possible(told: &Told) -> impl Iterator<Item = &str> {
    let rivals = told.ties.iter().flat_map(|tie| tie.rivals.iter().flatten()).map(String::as_str);
    told.effects.iter().map(|effect| effect.name.as_str()).chain(rivals)
}
