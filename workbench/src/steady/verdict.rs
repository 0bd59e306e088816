//! From the accepted set to the one result: names, ties, rivals, uncertainties, what is left, what to measure next.

use super::fit::{Fit, Problem};
use super::plots::Gallery;
use super::rivals::{Replacement, is_scale};
use super::search::Search;
use super::separate::{self, Contrast};
use super::study::{Growth, HeldOut, Residual, deviation, grow};
use super::table;
use super::words::{self, SpeedUnit};
use crate::log::Table;
use crate::outcome::*;
use crate::plant::physics::Physics;
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// Structure is called unexplained above this share of the first gap (squared) …
const SHARE_LEFT: f64 = 0.05;
/// … if neighbouring residuals are alike by this many standard deviations …
const ALIKE: f64 = 4.0;
/// … and it is larger than the noise (mean squares).
const ABOVE_NOISE: f64 = 1.0;
/// Losing explanations that are listed for each effect.
const LOSERS: usize = 3;
/// Explanations that were tried on top and brought nothing, listed.
const IDLE: usize = 4;
/// A deviation beyond this share of the parameter's range says that the rows do not feel it.
const UNFELT: f64 = 0.2;
/// Tables of more rows than this are compared with rivals on their chosen rows.
const LONG: usize = 120;
/// A parameter this near to its bound, as a share of the range, sits on it.
const VANISHED: f64 = 1e-3;
/// A base parameter that moved by more than this share of its tolerance is reported.
const MOVED: f64 = 0.05;

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
struct Found<'a> {
    growth: Growth,
    /// Fitted to the chosen rows: what the gap on the others is measured with.
    chosen: Fit,
    /// Every row fitted.
    problem: &'a Problem<'a>,
    /// Fitted to every row: what is reported.
    fit: Fit,
    covariance: Option<DMatrix<f64>>,
    plant: Physics,
    ties: Vec<(usize, Vec<Replacement>)>,
    losers: Vec<(usize, Replacement)>,
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

    fn display(&self, unit: SpeedUnit, omega: f64) -> f64 {
        omega / unit.rad_s
    }

    fn effects(&self, found: &Found, unit: SpeedUnit) -> Vec<NamedEffect> {
        let steps = self.steps(found, unit);
        (0..found.fit.forms.len())
            .map(|k| {
                let effect = found.fit.forms[k].effect;
                let (before, after) = (steps[k].gap, steps[k + 1].gap);
                let text = words::evidence(effect.name, &found.plant, self.search.problem.base, unit);
                NamedEffect {
                    name: effect.name.into(),
                    parameters: self.parameters(found, k),
                    derived: derived(found, effect.name),
                    gap_before: before,
                    gap_after: after,
                    evidence: format!(
                        "{}; on held-out rows the gap goes from {} to {} {}.",
                        capitalised(&text),
                        crate::report::gap(before),
                        crate::report::gap(after),
                        unit.name
                    ),
                    tie: found.ties.iter().position(|t| t.0 == k),
                }
            })
            .collect()
    }

    /// Fitted parameters with deviations. A pinned parameter is part of the form: exact.
    fn parameters(&self, found: &Found, k: usize) -> BTreeMap<String, Value> {
        let form = &found.fit.forms[k];
        let mut index: usize = found.fit.forms[..k].iter().map(|f| f.size()).sum();
        let mut parameters = BTreeMap::new();
        for ((p, value), pin) in form
            .effect
            .parameters
            .iter()
            .zip(found.fit.values(k))
            .zip(&form.pinned)
        {
            let free = pin.is_none();
            let range = (p.upper - p.lower) * found.problem.natural.unit(p.scale);
            let std = found
                .covariance
                .as_ref()
                .filter(|_| free)
                .map(|c| c[(index, index)].sqrt());
            // What the rows do not feel (a start from rest lies somewhere between two of them) has no deviation to state.
            let std = std.filter(|std| *std < UNFELT * range);
            index += usize::from(free);
            // An optional parameter at its default is not part of the simplest form.
            if free || p.default.is_none() {
                parameters.insert(
                    p.name.to_string(),
                    Value {
                        value,
                        std,
                        unit: p.unit.into(),
                    },
                );
            }
        }
        parameters
    }

    fn steps(&self, found: &Found, unit: SpeedUnit) -> Vec<Step> {
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

    fn within_tolerance(&self, found: &Found) -> Vec<Shift> {
        let size = found.fit.size();
        let nuisances = found.problem.nuisances.iter().enumerate();
        let moved = nuisances.filter(|(j, n)| found.fit.shifts()[*j].abs() > MOVED * n.tolerance);
        let shift = |(j, n): (usize, &super::fit::Nuisance)| {
            let ratio = found.fit.shifts()[j].exp();
            let std = found
                .covariance
                .as_ref()
                .map_or(n.tolerance, |c| c[(size + j, size + j)].sqrt().min(n.tolerance));
            n.keys.iter().map(move |key| Shift {
                parameter: key.to_string(),
                shift_percent: 100.0 * (ratio - 1.0),
                std_percent: 100.0 * ratio * std,
            })
        };
        moved.flat_map(shift).collect()
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

    /// The ties, each with the contrast that separates its first rivals.
    fn ties(&self, found: &Found, noise: f64, unit: SpeedUnit) -> Vec<(Tie, Option<Contrast>)> {
        let top = found
            .problem
            .data
            .volts
            .iter()
            .fold(0.0_f64, |m, u| m.max(u.abs()));
        let tie = |(k, tied): &(usize, Vec<Replacement>)| {
            let name = found.fit.forms[*k].effect.name.to_string();
            let contrasts: Vec<(String, Contrast)> = tied
                .iter()
                .filter_map(|r| {
                    let other = self.search.problem.plant(&r.fit.forms, &r.fit.x);
                    Some((
                        r.names.join(" + "),
                        separate::best(&found.plant, &other, top, noise)?,
                    ))
                })
                .collect();
            let rivals = std::iter::once(vec![name])
                .chain(tied.iter().map(|r| r.names.clone()))
                .collect();
            let separated_by = separation(&contrasts, noise, unit);
            (
                Tie { rivals, separated_by },
                contrasts.into_iter().next().map(|c| c.1),
            )
        };
        found.ties.iter().map(tie).collect()
    }

    fn rivals(&self, found: &Found, unit: SpeedUnit) -> Vec<Rival> {
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
                names: r.names.clone(),
                gap,
                reason,
            }
        });
        let added = self.search.additions(&found.chosen);
        // A dead zone is what everybody asks about first.
        let listed = |(k, r): &(usize, Replacement)| *k < IDLE || r.names[0] == "dead_zone";
        let idle = added.into_iter().enumerate().filter(listed).map(|(_, r)| Rival {
            gap: self.gap(&r.fit, unit),
            reason: r.objection.clone().unwrap_or_default() + &at_bound(found.problem, &r),
            names: r.names,
        });
        lost.chain(idle).collect()
    }

    /// Held-out gap of a set.
    fn gap(&self, fit: &Fit, unit: SpeedUnit) -> f64 {
        let plant = self.search.problem.plant(&fit.forms, &fit.x);
        self.display(unit, self.held_out.rms(&plant))
    }

    /// Held-out gap of a replacement, refitted to the chosen rows alone.
    fn refitted_gap(&self, r: &Replacement, unit: SpeedUnit) -> f64 {
        let refit = self
            .search
            .problem
            .best(&r.fit.forms, std::slice::from_ref(&r.fit.x));
        refit.map_or(f64::NAN, |fit| self.gap(&fit, unit))
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

fn derived(found: &Found, name: &str) -> BTreeMap<String, Value> {
    let figures = words::derived(name).into_iter().map(|(key, unit, figure)| {
        let std = found
            .covariance
            .as_ref()
            .and_then(|c| deviation(found.problem, &found.fit, c, figure));
        (
            key.to_string(),
            Value {
                value: figure(&found.plant),
                std,
                unit: unit.into(),
            },
        )
    });
    figures.filter(|(_, v)| v.value.is_finite()).collect()
}

/// Edges and knees for the plots.
fn marks(effects: &[NamedEffect]) -> Vec<(f64, String)> {
    let labels = [
        ("knee_command_v", "knee"),
        ("stops_above_v", "dead zone"),
        ("stops_below_v", "dead zone"),
    ];
    let all = effects.iter().flat_map(|e| &e.derived);
    let mark = |(key, v): (&String, &Value)| {
        let label = labels.iter().find(|l| l.0 == key)?;
        Some((v.value, format!("{} {} V", label.1, words::figure(v.value))))
    };
    all.filter_map(mark).collect()
}

/// By what each rival is told from the accepted name, and how far apart they would be.
fn separation(contrasts: &[(String, Contrast)], noise: f64, unit: SpeedUnit) -> String {
    let one = |(rival, c): &(String, Contrast)| match c.visible_in_speed(noise) {
        true => format!(
            "from {rival} by the speed over time in {} (up to {} apart)",
            c.protocol.name,
            unit.text(c.speed_rad_s)
        ),
        false if c.current_a > 1e-3 => format!(
            "from {rival} by the winding current in {} (up to {} A apart, while the speeds agree)",
            c.protocol.name,
            words::figure(c.current_a)
        ),
        false => format!("from {rival} by nothing that speed and current show: inspect the parts themselves"),
    };
    contrasts.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// The experiment of the first tie that one can separate; another tie is often separated by the same run.
fn next(ties: &[(Tie, Option<Contrast>)]) -> Option<Experiment> {
    let (tie, contrast) = ties.iter().find_map(|(t, c)| Some((t, c.as_ref()?)))?;
    let rivals: Vec<String> = tie.rivals.iter().map(|r| r.join(" + ")).collect();
    let why = format!(
        "It tells {} apart. Log speed over time, and the winding current if you can.",
        rivals.join(", ")
    );
    Some(Experiment {
        why,
        profile: contrast.protocol.profile.clone(),
    })
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

/// Mentions a parameter that ran into its bound.
fn at_bound(problem: &Problem, r: &Replacement) -> String {
    for (k, form) in r
        .fit
        .forms
        .iter()
        .enumerate()
        .filter(|(_, f)| r.names.iter().any(|n| n == f.effect.name))
    {
        for (p, value) in form.effect.parameters.iter().zip(r.fit.values(k)) {
            let unit = problem.natural.unit(p.scale);
            let near = |bound: f64| (value - bound * unit).abs() < VANISHED * unit * (p.upper - p.lower);
            let sizes = is_scale(form.effect) || near(p.upper);
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

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
