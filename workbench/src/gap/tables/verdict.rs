//! From the accepted set to the one result: names, ties, rivals, uncertainties, what is left, what to measure next.

use super::fit::{Fit, Problem};
use super::named::marks;
use super::plots::Gallery;
use super::rivals::Replacement;
use super::search::Search;
use super::separate::Contrast;
use super::study::{Growth, HeldOut, Residual, grow};
use super::table;
use super::ties::next;
use super::words::{self, SpeedUnit};
use crate::outcome::*;
use crate::system::log::Table;
use crate::system::plant::physics::Physics;
use nalgebra::DMatrix;

/// Structure is called unexplained above this share of the first gap (squared) …
const SHARE_LEFT: f64 = 0.05;
/// … if neighbouring residuals are alike by this many standard deviations …
const ALIKE: f64 = 4.0;
/// … and it is larger than the noise (mean squares).
const ABOVE_NOISE: f64 = 1.0;
/// Losing explanations that are listed for each effect.
const LOSERS: usize = 3;
/// Tables of more rows than this are compared with rivals on their chosen rows.
const LONG: usize = 120;

/// Everything that a verdict is made of.
pub struct Case<'a> {
    /// The table.
    pub log: &'a Table,
    /// The search, with the rows that were fitted.
    pub search: &'a Search<'a>,
    /// The rows that were not.
    pub held_out: &'a HeldOut<'a>,
    /// True if they come from other files.
    pub separate_files: bool,
}

/// The accepted set, fitted to the chosen rows and to all rows.
pub(super) struct Found<'a> {
    pub(super) growth: Growth,
    /// Fitted to the chosen rows: what the gap on the others is measured with.
    pub(super) chosen: Fit,
    /// Every row fitted.
    pub(super) problem: &'a Problem<'a>,
    /// Fitted to every row: what is reported.
    pub(super) fit: Fit,
    pub(super) covariance: Option<DMatrix<f64>>,
    pub(super) plant: Physics,
    pub(super) ties: Vec<(usize, Vec<Replacement>)>,
    pub(super) losers: Vec<(usize, Replacement)>,
}

/// The result when nothing could be tested.
pub fn insufficient(log: &Table, reason: String) -> Outcome {
    let unit = SpeedUnit::of(log.speed_unit_rad_s);
    Outcome {
        schema: "truing-gap/1",
        verdict: Verdict::InsufficientExcitation,
        effects: vec![],
        ties: vec![],
        closest_known: vec![],
        holdout: HoldOut {
            signal: unit.column.into(),
            rmse_before: f64::NAN,
            rmse_after: f64::NAN,
            noise_floor: f64::NAN,
            fit_percent_before: f64::NAN,
            fit_percent_after: f64::NAN,
        },
        final_records: None,
        within_tolerance: vec![],
        places: vec![],
        unexplained: Unexplained {
            share_of_gap: 0.0,
            structure: "none".into(),
        },
        next_experiment: Some(Experiment {
            why: reason.clone(),
            profile: vec![],
        }),
        runtime_s: 0.0,
        notes: vec![reason],
        steps: vec![],
        rivals: vec![],
        plots: vec![],
        gap_unit: unit.name.into(),
    }
}

impl Case<'_> {
    /// The result for an accepted set.
    pub fn outcome(&self, accepted: &Fit) -> Outcome {
        let whole = self.search.problem.data.whole();
        let problem = Problem {
            data: &whole,
            ..*self.search.problem
        };
        let found = self.found(accepted, &problem);
        let residual = Residual::of(&whole, &found.plant);
        let unit = SpeedUnit::of(self.log.speed_unit_rad_s);
        let ties = self.ties(&found, residual.noise(), unit);
        let unexplained = self.unexplained(&found, &residual);
        let effects = self.effects(&found, unit);
        let marks = marks(&effects);
        let gallery = Gallery {
            data: self.search.problem.data,
            given: self.search.problem.base,
            extended: &found.plant,
            unit,
            noise: residual.noise(),
            marks: marks.clone(),
        };
        Outcome {
            final_records: None,
            schema: "truing-gap/1",
            verdict: verdict(&unexplained, &ties, &effects),
            closest_known: vec![],
            holdout: self.holdout(&found, &residual, unit),
            within_tolerance: self.within_tolerance(&found),
            places: self.places(&marks),
            unexplained,
            next_experiment: next(&ties),
            runtime_s: 0.0,
            notes: self.notes(),
            steps: self.steps(&found, unit),
            rivals: self.rivals(&found, unit),
            plots: gallery.plots(),
            gap_unit: unit.name.into(),
            ties: ties.into_iter().map(|t| t.0).collect(),
            effects,
        }
    }

    fn found<'b>(&self, accepted: &Fit, problem: &'b Problem<'b>) -> Found<'b> {
        let growth = grow(self.search, accepted);
        let chosen = growth.sets.last().unwrap_or(accepted).clone();
        let fit = problem
            .best(&chosen.forms, std::slice::from_ref(&chosen.x))
            .unwrap_or_else(|| chosen.clone());
        let inflation = self.search.inflation(&chosen);
        let covariance = problem.covariance(&fit).map(|c| c * inflation);
        let plant = problem.plant(&fit.forms, &fit.x);
        let mut found = Found {
            growth,
            chosen,
            problem,
            fit,
            covariance,
            plant,
            ties: vec![],
            losers: vec![],
        };
        self.compare(&mut found, inflation);
        found
    }

    /// Parts the replacements of every effect into ties and losers, with every row: what they cannot tell is a tie.
    fn compare(&self, found: &mut Found, inflation: f64) {
        // Half of a long table tells as much; every row of a short one counts.
        let long = found.problem.data.volts.len() > LONG;
        let problem = if long { self.search.problem } else { found.problem };
        let fit = if long {
            found.chosen.clone()
        } else {
            found.fit.clone()
        };
        let search = Search {
            problem,
            offer: self.search.offer,
        };
        for k in 0..fit.forms.len() {
            let all = search.replacements(&fit, k);
            let (tied, lost): (Vec<_>, Vec<_>) = all.into_iter().partition(|r| r.ties(inflation));
            if !tied.is_empty() {
                found.ties.push((k, tied));
            }
            found.losers.extend(lost.into_iter().take(LOSERS).map(|r| (k, r)));
        }
    }

    pub(super) fn display(&self, unit: SpeedUnit, omega: f64) -> f64 {
        omega / unit.rad_s
    }

    pub(super) fn steps(&self, found: &Found, unit: SpeedUnit) -> Vec<Step> {
        let problem = self.search.problem;
        let gap = |plant: &Physics| self.display(unit, self.held_out.rms(plant));
        let mut steps = vec![Step {
            label: "model as given".into(),
            gap: gap(problem.base),
        }];
        for set in &found.growth.sets {
            let label = set
                .forms
                .last()
                .map_or(String::new(), |f| format!("+ {}", f.effect.name));
            steps.push(Step {
                label,
                gap: gap(&problem.plant(&set.forms, &set.x)),
            });
        }
        if found.growth.sets.is_empty() && found.chosen.shifts().iter().any(|s| *s != 0.0) {
            let plant = problem.plant(&[], &found.chosen.x);
            steps.push(Step {
                label: "base within its tolerance".into(),
                gap: gap(&plant),
            });
        }
        steps
    }

    fn holdout(&self, found: &Found, residual: &Residual, unit: SpeedUnit) -> HoldOut {
        let problem = self.search.problem;
        let extended = problem.plant(&found.chosen.forms, &found.chosen.x);
        HoldOut {
            signal: unit.column.into(),
            rmse_before: self.display(unit, self.held_out.rms(problem.base)),
            rmse_after: self.display(unit, self.held_out.rms(&extended)),
            noise_floor: self.display(unit, residual.noise()),
            fit_percent_before: self.held_out.fit_percent(problem.base),
            fit_percent_after: self.held_out.fit_percent(&extended),
        }
    }

    fn places(&self, marks: &[(f64, String)]) -> Vec<Where> {
        let whole = self.search.problem.data.whole();
        let residual = Residual::of(&whole, self.search.problem.base);
        let largest = whole.volts.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
        let positions: Vec<f64> = marks.iter().map(|m| m.0).collect();
        let shares = words::shares(&residual, &words::regions(&positions, largest));
        shares
            .into_iter()
            .map(|(region, share_of_squared_error)| Where {
                region,
                share_of_squared_error,
            })
            .collect()
    }

    fn unexplained(&self, found: &Found, residual: &Residual) -> Unexplained {
        let noise = residual.noise().powi(2);
        let first = Residual::of(found.problem.data, self.search.problem.base)
            .rms()
            .powi(2);
        let left = (residual.rms().powi(2) - noise).max(0.0);
        let share = left / (first - noise).max(left).max(f64::MIN_POSITIVE);
        let structured = share > SHARE_LEFT && residual.likeness() > ALIKE && left > ABOVE_NOISE * noise;
        let structure = if structured {
            shape(residual)
        } else {
            "none".into()
        };
        Unexplained {
            share_of_gap: share,
            structure,
        }
    }

    /// Held-out gap of a set.
    pub(super) fn gap(&self, fit: &Fit, unit: SpeedUnit) -> f64 {
        let plant = self.search.problem.plant(&fit.forms, &fit.x);
        self.display(unit, self.held_out.rms(&plant))
    }

    fn notes(&self) -> Vec<String> {
        let data = self.search.problem.data;
        let (rows, fitted) = (data.volts.len(), data.rows());
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

fn verdict(unexplained: &Unexplained, ties: &[(Tie, Option<Contrast>)], effects: &[NamedEffect]) -> Verdict {
    match (
        unexplained.structure != "none",
        ties.is_empty(),
        effects.is_empty(),
    ) {
        (true, _, _) => Verdict::Unexplained,
        (_, false, _) => Verdict::Tie,
        (_, _, false) => Verdict::Named,
        _ => Verdict::NothingMissing,
    }
}

/// Where the structured rest sits.
fn shape(residual: &Residual) -> String {
    let largest = residual.volts.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
    let thirds = words::shares(residual, &words::regions(&[], largest));
    match thirds.first() {
        Some((region, share)) => format!(
            "a smooth function of the voltage, {:.0} % of it at {region}",
            100.0 * share
        ),
        None => "a smooth function of the voltage".into(),
    }
}
