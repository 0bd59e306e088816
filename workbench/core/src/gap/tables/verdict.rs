//! From the accepted set to the one result: names, ties, rivals, uncertainties, what is left, what to measure next.

use super::case::{Case, Found};
use super::fit::Set;
use super::named::marks;
use super::plots::Gallery;
use super::rivals::Replacement;
use super::sets::Search;
use super::speed_unit::SpeedUnit;
use super::study::{Residual, grow};
use super::ties::next;
use super::{table, words};
use crate::gap::acceptance::prediction::compared;
use crate::gap::fit::hypothesis::Item;
use crate::gap::options::ShareLimits;
use crate::outcome::*;
use crate::system::effects::DEAD_ZONE;
use crate::system::log::Table;
use crate::system::plant::physics::Physics;
use crate::text::figures;

/// Structure is called unexplained above this share of the first squared gap, if [`ALIKE`] and [`ABOVE_NOISE`] hold,
/// too. Chosen by judgement; not studied.
const SHARE_LEFT: f64 = 0.05;
/// Neighbouring residuals are alike if their correlation is this many standard deviations from none. Chosen by
/// judgement; not studied.
const ALIKE: f64 = 4.0;
/// What is left must be this many times the noise (mean squares). Chosen by judgement; not studied.
const ABOVE_NOISE: f64 = 1.0;
/// Losing explanations that are listed for each effect. For display, chosen by judgement.
const REJECTED: usize = 3;
/// Tables of more rows than this are compared with rivals on their chosen rows. A budget of computing time, chosen by
/// judgement.
const LONG: usize = 120;

/// The result when nothing could be tested.
pub fn insufficient(log: &Table, reason: String) -> Outcome {
    let unit = SpeedUnit::of(log.speed_unit_rad_s);
    Outcome {
        next_experiment: Some(Experiment::new(reason.clone(), vec![], "V")),
        notes: vec![reason],
        ..Outcome::untested(unit.column, f64::NAN, unit.name)
    }
}

impl Case<'_> {
    /// The result for an accepted set.
    pub fn outcome(&self, accepted: &Set) -> Outcome {
        let whole = self.search.rows.all_fitted();
        let everything = Search { rows: &whole, ..self.search };
        let found = self.found(accepted, everything);
        let residual = Residual::of(&whole, &found.plant);
        let unit = SpeedUnit::of(self.log.speed_unit_rad_s);
        let ties = self.ties(&found, residual.noise(), unit);
        let unexplained = self.unexplained(&residual);
        let effects = self.effects(&found, unit);
        let marks = marks(&effects);
        let gallery = Gallery {
            data: self.search.rows,
            given: self.given,
            extended: &found.plant,
            unit,
            noise: residual.noise(),
            marks: marks.clone(),
        };
        let holdout = self.holdout(&found, &residual, unit);
        let left = unexplained.is_left();
        let limits = ShareLimits::default();
        let leaves = (holdout.rmse_after / holdout.rmse_before).powi(2);
        // Beside a model that is a fit to the table, names stand although something is left.
        let names_stand =
            self.search.model.fitted_to_log && !effects.is_empty() && leaves < limits.against_given;
        let verdict = Verdict::of(left && !names_stand, !ties.is_empty(), !effects.is_empty());
        Outcome {
            grade: Grade::of(verdict, left, leaves < limits.likely),
            within_tolerance: self.within_tolerance(&found),
            places: self.places(&marks),
            unexplained,
            next_experiment: next(&ties),
            notes: self.notes(),
            steps: self.steps(&found, unit),
            rivals: self.rivals(&found, unit),
            plots: gallery.plots(),
            ties: ties.into_iter().map(|t| t.0).collect(),
            effects,
            ..Outcome::new(verdict, holdout, unit.name)
        }
    }

    fn found<'b>(&'b self, accepted: &Set<'b>, everything: Search<'b>) -> Found<'b> {
        let growth = grow(&self.search, accepted);
        let chosen = growth.last().unwrap_or(accepted).clone();
        let set = everything.again(&chosen).unwrap_or_else(|| chosen.clone());
        let inflation = chosen.inflation();
        let mut found = Found {
            growth,
            covariance: set.covariance().map(|c| c * inflation),
            plant: set.plant(),
            chosen,
            set,
            ties: vec![],
            rejected: vec![],
        };
        // Half of a long table tells as much; every row of a short one counts.
        let long = self.search.rows.volts.len() > LONG;
        let search = if long { self.search } else { everything };
        compare(&search, &mut found, long, inflation);
        found
    }

    pub(super) fn steps(&self, found: &Found, unit: SpeedUnit) -> Vec<Step> {
        let step =
            |label: String, plant: &Physics| Step { label, gap: self.held_out.predicted(plant, unit).gap() };
        let mut steps = vec![step("model as given".into(), self.given)];
        steps.extend(found.growth.iter().map(|set| {
            let newest = set.hypothesis.items.last();
            let label = newest.map_or(String::new(), |it| format!("+ {}", it.effect.name));
            step(label, &set.plant())
        }));
        if found.growth.is_empty() && found.chosen.fit.x.iter().any(|shift| *shift != 0.0) {
            steps.push(step("base within its tolerance".into(), &found.chosen.plant()));
        }
        steps
    }

    fn holdout(&self, found: &Found, residual: &Residual, unit: SpeedUnit) -> HoldOut {
        let (before, after) = (self.given, &found.chosen.plant());
        let predicted = |plant| self.held_out.predicted(plant, unit);
        let noise = residual.noise() / unit.rad_s;
        compared(unit.column, noise, predicted(before).into(), predicted(after).into())
    }

    fn places(&self, marks: &[(f64, String)]) -> Vec<Where> {
        let residual = Residual::of(self.search.rows, self.given);
        let positions: Vec<f64> = marks.iter().map(|m| m.0).collect();
        let regions = words::regions(&positions, self.search.rows.top_v());
        let place = |(region, share)| Where { region, share_of_squared_error: share, also: Vec::new() };
        words::error_by_region(&residual, &regions).into_iter().map(place).collect()
    }

    fn unexplained(&self, residual: &Residual) -> Unexplained {
        let noise = residual.noise().powi(2);
        let first = Residual::of(self.search.rows, self.given).rms().powi(2);
        let left = (residual.rms().powi(2) - noise).max(0.0);
        let share = left / (first - noise).max(left).max(f64::MIN_POSITIVE);
        let structured = share > SHARE_LEFT && residual.likeness() > ALIKE && left > ABOVE_NOISE * noise;
        Unexplained::new(share, structured.then(|| shape(residual)))
    }

    /// Held-out gap of a set.
    pub(super) fn gap(&self, set: &Set, unit: SpeedUnit) -> f64 {
        self.held_out.predicted(&set.plant(), unit).gap()
    }

    /// Explanations that lost, each with its reason.
    fn rivals(&self, found: &Found, unit: SpeedUnit) -> Vec<Rival> {
        let now = figures::gap(self.gap(&found.chosen, unit));
        let reason = |(k, r): &(usize, Replacement)| {
            let name = found.set.hypothesis.items[*k].effect.name;
            // Refitted to the chosen rows alone.
            let gap = self.search.again(&r.set).map_or(f64::NAN, |set| self.gap(&set, unit));
            let told = || format!("for {name} it leaves {} {1}, not {now} {1}", figures::gap(gap), unit.name);
            Rival { names: r.names(), gap, reason: r.objection.clone().unwrap_or_else(told) }
        };
        // A dead zone is what everybody asks about first.
        let offered = self.search.compatible(&found.chosen, &DEAD_ZONE);
        let zone = offered.then(|| self.search.extended(&found.chosen, &Item::plain(&DEAD_ZONE))).flatten();
        let zone = zone.map(|set| {
            let gap = self.gap(&set, unit);
            let reason = format!("added, it leaves {} {}", figures::gap(gap), unit.name);
            Rival { names: vec![DEAD_ZONE.name.into()], gap, reason }
        });
        found.rejected.iter().map(reason).chain(zone).collect()
    }

    fn notes(&self) -> Vec<String> {
        let (rows, fitted) = (self.search.rows.volts.len(), self.search.rows.count());
        let mut notes = vec![match self.separate_files {
            true => format!("All {rows} rows were fitted; the gap is that of the separate files."),
            false => format!(
                "{fitted} of {rows} rows chose the effects; every {} was held out, and the gap is theirs. The reported \
                 parameters come from all rows.",
                if fitted * 2 > rows + 1 { "third" } else { "second" }
            ),
        }];
        notes.push(
            "A settled speed shows no inertia, inductance, delay, lag or play: these were not tested.".into(),
        );
        notes.extend(table::blind_spots(self.log));
        notes
    }
}

/// Parts the replacements of every effect into ties and rejected: what the rows of the search cannot tell is a tie.
fn compare<'a>(search: &Search<'a>, found: &mut Found<'a>, long: bool, inflation: f64) {
    let set = if long { &found.chosen } else { &found.set };
    for k in 0..set.hypothesis.items.len() {
        let all = search.replacements(set, k);
        let (tied, lost): (Vec<_>, Vec<_>) = all.into_iter().partition(|r| r.ties(inflation));
        if !tied.is_empty() {
            found.ties.push((k, tied));
        }
        let lost = lost.into_iter().take(REJECTED);
        found.rejected.extend(lost.map(|replacement| (k, replacement)));
    }
}

/// Where the structured rest sits.
fn shape(residual: &Residual) -> String {
    let largest = residual.volts.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
    match words::error_by_region(residual, &words::regions(&[], largest)).first() {
        Some((region, share)) => {
            format!("a smooth function of the voltage, {:.0} % of it at {region}", 100.0 * share)
        }
        None => "a smooth function of the voltage".into(),
    }
}
