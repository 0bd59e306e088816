//! A picture of a dependence: the missing torque in bins of the variable, in the log and in the held-out data, beside the table.

use super::track::{Compared, Tracks};
use super::words;
use crate::gap::dataset::Part;
use crate::gap::fit::samples::{Sample, samples};
use crate::gap::fit::scored::Scored;
use crate::outcome::{Curve, Plot, Role, Series, Stage, Style};
use crate::system::plant::unnamed::{Acting, Moment, Term, Variable};

/// Bins of the variable. For display, chosen by judgement.
const BINS: usize = 24;

/// The picture of a term over its first variable. `bare`: the set without the term.
pub fn of(bare: &Scored, tracks: &Tracks, compared: &[Compared], term: &Term) -> Plot {
    let dataset = bare.hypothesis.dataset;
    let variable = term.over[0].variable;
    let moments: Vec<&Moment> = tracks.moments(&bare.hypothesis).collect();
    let seen = samples(bare, &[Part::A, Part::B, Part::HoldOut, Part::Masked]);
    let per_unit = match term.acts {
        Acting::Input => bare.plant().torque_per_input(),
        _ => 1.0,
    };
    let points = |held_out: bool, direction: f64| -> Vec<(f64, f64)> {
        let places = (0..moments.len().min(seen.len())).filter(|k| {
            let part = compared[*k].part;
            part != Part::Masked
                && (part == Part::HoldOut) == held_out
                && moments[*k].omega * direction >= 0.0
        });
        places
            .map(|k| {
                (moments[k].of(variable, term.standstill), missing(term, &seen[k], moments[k], per_unit))
            })
            .collect()
    };
    let mut series = Vec::new();
    for (direction, label) in directions(term) {
        let backwards = direction < 0.0;
        let of = |role| if backwards { Role::Further(0) } else { role };
        let mut add = |what: &str, curve: Curve, style, role| {
            series.push(Series::new(&format!("{what}{label}"), curve, style).of(of(role)));
        };
        add("log", Curve::binned(points(false, direction), BINS), Style::Points, Role::Measured);
        add("held out", Curve::binned(points(true, direction), BINS), Style::Hollow, Role::Measured);
        add("table", line(term, direction), Style::Line, Role::Extended);
    }
    let unit = words::unit(variable, dataset.linear, dataset.input.unit());
    Plot {
        title: format!("What is left over {}", words::name(variable)),
        caption: "Means of what the names leave over bins of the simulated motion, in the log and in the held-out data, and the table of the term without a name".into(),
        stage: Stage::Characterisation,
        x_label: format!("{}, {unit}", words::name(variable)),
        y_label: lacking(term, dataset.linear, dataset.input.unit()),
        series,
        ..Plot::default()
    }
}

/// What is missing, with its unit.
fn lacking(term: &Term, linear: bool, input: &str) -> String {
    match (term.acts, linear) {
        (Acting::Torque, false) => "missing torque, N m".into(),
        (Acting::Torque, true) => "missing force, N".into(),
        (Acting::Input, _) => format!("missing input, {input}"),
        (Acting::Reading, _) => "relative error of the reading".into(),
    }
}

/// One curve, or one a direction where the table tells them apart.
fn directions(term: &Term) -> Vec<(f64, &'static str)> {
    match term.over.get(1).map(|knots| knots.variable) {
        Some(Variable::Direction) => vec![(1.0, ", forwards"), (-1.0, ", backwards")],
        _ => vec![(0.0, "")],
    }
}

/// What the plant or the reading lacks at a sample.
fn missing(term: &Term, sample: &Sample, moment: &Moment, per_unit: f64) -> f64 {
    match term.acts {
        Acting::Reading if moment.omega.abs() > term.standstill => sample.residual() / moment.omega,
        Acting::Reading => 0.0,
        _ => sample.torque / per_unit,
    }
}

/// The table at its knots; over a second variable that is no direction, the mean of each row.
fn line(term: &Term, direction: f64) -> Curve {
    let inner = term.over.get(1).map_or(1, |knots| knots.at.len());
    let value = |row: &[f64]| match (direction, row) {
        (0.0, row) => row.iter().sum::<f64>() / inner as f64,
        (_, row) if direction > 0.0 => row[row.len() - 1],
        (_, row) => row[0],
    };
    Curve { x: term.over[0].at.clone(), y: term.values.chunks(inner).map(value).collect() }
}
