//! Explanations that lost, each with its reason.

use super::fit::Problem;
use super::rivals::Replacement;
use super::verdict::{Case, Found};
use super::words::{self, SpeedUnit};
use crate::outcome::*;
use crate::system::effects::DEAD_ZONE;

/// Explanations that were tried on top and brought nothing, listed.
const IDLE: usize = 4;
/// A parameter this near to its bound, as a share of the range, sits on it.
const VANISHED: f64 = 1e-3;

impl Case<'_> {
    pub(super) fn rivals(&self, found: &Found, unit: SpeedUnit) -> Vec<Rival> {
        let now = crate::report::gap(self.gap(&found.chosen, unit));
        let lost = found.losers.iter().map(|(k, r)| {
            let name = found.fit.forms[*k].effect.name;
            let gap = self.refitted_gap(r, unit);
            let left = crate::report::gap(gap);
            let reason = r.objection.clone().unwrap_or_else(|| {
                let bound = at_bound(found.problem, r);
                format!(
                    "in place of {name} it leaves {left} {0} instead of {now} {0}{bound}",
                    unit.name
                )
            });
            Rival {
                names: r.names(),
                gap,
                reason,
            }
        });
        let added = self.search.additions(&found.chosen);
        // A dead zone is what everybody asks about first.
        let listed = |(k, r): &(usize, Replacement)| *k < IDLE || r.effects[0] == &DEAD_ZONE;
        let idle = added.into_iter().enumerate().filter(listed).map(|(_, r)| Rival {
            gap: self.gap(&r.fit, unit),
            reason: r.objection.clone().unwrap_or_default() + &at_bound(found.problem, &r),
            names: r.names(),
        });
        lost.chain(idle).collect()
    }

    /// Held-out gap of a replacement, refitted to the chosen rows alone.
    fn refitted_gap(&self, r: &Replacement, unit: SpeedUnit) -> f64 {
        let refit = self
            .search
            .problem
            .best(&r.fit.forms, std::slice::from_ref(&r.fit.x));
        refit.map_or(f64::NAN, |fit| self.gap(&fit, unit))
    }
}

/// Mentions a parameter that ran into its bound.
fn at_bound(problem: &Problem, r: &Replacement) -> String {
    for (k, form) in r
        .fit
        .forms
        .iter()
        .enumerate()
        .filter(|(_, f)| r.effects.contains(&f.effect))
    {
        for (p, value) in form.effect.parameters.iter().zip(r.fit.values(k)) {
            let unit = problem.natural.unit(p.scale);
            let near = |bound: f64| (value - bound * unit).abs() < VANISHED * unit * (p.upper - p.lower);
            let sizes = form.effect.is_scale() || near(p.upper);
            if sizes && (near(p.lower) || near(p.upper)) {
                return format!(
                    ", and that only at its bound ({} = {})",
                    p.name,
                    words::figure(value)
                );
            }
            if near(p.lower) && p.default.is_none() {
                return format!("; fitted, it vanishes ({} = {})", p.name, words::figure(value));
            }
        }
    }
    String::new()
}
