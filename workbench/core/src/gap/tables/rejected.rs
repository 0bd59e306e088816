//! Explanations that lost, each with its reason.

use super::case::{Case, Found};
use super::rivals::Replacement;
use super::speed_unit::SpeedUnit;
use crate::gap::fit::hypothesis::Data;
use crate::outcome::*;
use crate::system::effects::DEAD_ZONE;

/// Explanations that were tried on top and brought nothing, listed. For display, chosen by judgement.
const IDLE: usize = 4;
/// A parameter this near to its bound, as a share of the range, sits on it. Chosen by judgement; not studied.
const VANISHED: f64 = 1e-3;

impl Case<'_> {
    pub(super) fn rivals(&self, found: &Found, unit: SpeedUnit) -> Vec<Rival> {
        let now = crate::text::figures::gap(self.gap(&found.chosen, unit));
        let lost = found.rejected.iter().map(|(k, r)| {
            let name = found.set.hypothesis.items[*k].effect.name;
            let gap = self.refitted_gap(r, unit);
            let left = crate::text::figures::gap(gap);
            let reason = r.objection.clone().unwrap_or_else(|| {
                let bound = at_bound(r);
                format!("in place of {name} it leaves {left} {0} instead of {now} {0}{bound}", unit.name)
            });
            Rival { names: r.names(), gap, reason }
        });
        let added = self.search.additions(&found.chosen);
        // A dead zone is what everybody asks about first.
        let listed = |(k, r): &(usize, Replacement)| *k < IDLE || r.effects[0] == &DEAD_ZONE;
        let idle = added.into_iter().enumerate().filter(listed).map(|(_, r)| Rival {
            gap: self.gap(&r.set, unit),
            reason: r.objection.clone().unwrap_or_default() + &at_bound(&r),
            names: r.names(),
        });
        lost.chain(idle).collect()
    }

    /// Held-out gap of a replacement, refitted to the chosen rows alone.
    fn refitted_gap(&self, r: &Replacement, unit: SpeedUnit) -> f64 {
        let refitted = self.search.again(&r.set);
        refitted.map_or(f64::NAN, |set| self.gap(&set, unit))
    }
}

/// Mentions a parameter that ran into its bound.
fn at_bound(r: &Replacement) -> String {
    let hypothesis = &r.set.hypothesis;
    let own = hypothesis.items.iter().enumerate().filter(|(_, item)| r.effects.contains(&item.effect));
    let parameters = own.flat_map(|(k, item)| {
        let values = hypothesis.values(k, &r.set.fit.x);
        let parameters = item.effect.parameters.iter().zip(values);
        parameters.map(|(parameter, value)| (item.effect.is_scale(), parameter, value))
    });
    let mut told = parameters.filter_map(|(is_scale, p, value)| {
        let x = value / hypothesis.dataset.scales().of(p.scale);
        let near = |bound: f64| (x - bound).abs() < VANISHED * (p.upper - p.lower);
        let value = crate::text::figures::figure(value);
        if near(p.upper) || (is_scale && near(p.lower)) {
            return Some(format!(", and that only at its bound ({} = {value})", p.name));
        }
        let vanished = near(p.lower) && p.default.is_none();
        vanished.then(|| format!("; fitted, it vanishes ({} = {value})", p.name))
    });
    told.next().unwrap_or_default()
}
