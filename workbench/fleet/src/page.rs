//! The page of a fleet.

use crate::appeared::Appeared;
use crate::findings::{Changed, Findings, SpreadOf};
use crate::moment::Moment;
use crate::series::{Quantity, Series, quantities};
use crate::stats::change::{Kind, Line};
use crate::stats::spread::Spread;
use crate::stats::step::Step;
use crate::stats::{Point, mean};
use crate::store::Kept;
use truing_core::outcome::{self, Curve, Plot, Role, Style};
use truing_report::report::figure;
use truing_report::report::html::Document;
use truing_report::report::section::{Section, Table};

/// Pictures of changes at most: the surest; the table has them all.
const PICTURES: usize = 12;
/// Letters of a hash that tell logs apart.
const SHORT: usize = 12;

/// The page. `command`: what wrote it.
pub fn page(fleet: &[(String, Vec<Kept>)], findings: &Findings, command: &str) -> Document {
    let quantities = quantities(fleet);
    let count = |number: usize, what: &str| format!("{number} {what}{}", if number == 1 { "" } else { "s" });
    let subtitle = format!("{}, {}", count(findings.units, "unit"), count(findings.logs, "log"));
    Document::new(title(findings), subtitle)
        .by(command)
        .section(appeared(fleet, findings))
        .section(changes(fleet, &quantities, findings))
        .section(units(&quantities, findings))
}

fn title(findings: &Findings) -> String {
    let confirmed = findings.appeared.iter().filter(|it| it.confirmed).map(|it| &it.unit);
    let mut units: Vec<&String> = findings.changed.iter().map(|it| &it.unit).chain(confirmed).collect();
    units.sort();
    units.dedup();
    match units.len() {
        0 => "Fleet: no unit changes".into(),
        1 => format!("Fleet: unit {} changes", units[0]),
        several => format!("Fleet: {several} units change"),
    }
}

/// Days since the fleet's first log.
fn day(fleet: &[(String, Vec<Kept>)], at: Moment) -> String {
    let first = fleet.iter().flat_map(|(_, results)| results).map(|kept| kept.key.at).min();
    first.map_or_else(String::new, |first| format!("day {}", figure(at.days_since(first))))
}

fn shortened(logs: &[String]) -> String {
    let short: Vec<&str> = logs.iter().map(|log| &log[..SHORT.min(log.len())]).collect();
    match short.as_slice() {
        [first, .., last] if short.len() > 3 => format!("{} logs, {first} to {last}", short.len()),
        few => few.join(", "),
    }
}

fn appeared(fleet: &[(String, Vec<Kept>)], findings: &Findings) -> Section {
    let row = |it: &Appeared| {
        let seen = format!("{} of {} logs since", it.logs.len(), it.of_logs);
        let sure = match (it.confirmed, it.of_logs) {
            (true, _) => seen,
            (false, 1) => "the last log alone".into(),
            (false, _) => format!("{seen}: not confirmed"),
        };
        let instead = if it.instead_of.is_empty() { "–".into() } else { it.instead_of.join(", ") };
        vec![it.unit.clone(), it.effect.clone(), day(fleet, it.at), sure, instead, shortened(&it.logs)]
    };
    let rows: Vec<Vec<String>> = findings.appeared.iter().map(row).collect();
    let text = match rows.is_empty() {
        true => "No unit has an effect that it did not have in its first log.",
        false => "Effects that a unit did not have in its first log, nor as a rival of a tie.",
    };
    let header = ["unit", "effect", "since", "seen in", "instead of", "logs (SHA-256)"];
    Section {
        title: "New effects".into(),
        text: vec![text.into()],
        tables: table("New effects", &header, rows),
        ..Section::default()
    }
}

fn table(caption: &str, header: &[&str], rows: Vec<Vec<String>>) -> Vec<Table> {
    let header = header.iter().map(|head| (*head).to_owned()).collect();
    let table = Table { caption: caption.into(), header, rows };
    if table.rows.is_empty() { Vec::new() } else { vec![table] }
}

fn changes(fleet: &[(String, Vec<Kept>)], quantities: &[Quantity], findings: &Findings) -> Section {
    let row = |it: &Changed| {
        let kind = if it.kind == Kind::Drift { "drift" } else { "step" };
        let change = format!("{} ± {} {}", signed(it.change), figure(it.sigma), it.of);
        let (since, q) = (day(fleet, it.at), format!("{:.1e}", it.q));
        vec![it.unit.clone(), it.quantity.clone(), kind.into(), change, since, q, shortened(&it.logs)]
    };
    let text = format!(
        "{} drifts and steps among {} tests. Of all that are told about {:.0} % are expected to be false.",
        findings.changed.len(),
        findings.tests,
        100.0 * findings.rate
    );
    let header = ["unit", "number", "kind", "change", "since", "q", "logs (SHA-256)"];
    Section {
        title: "Drifts and steps".into(),
        text: vec![text],
        plots: findings.changed.iter().take(PICTURES).filter_map(|it| picture(quantities, it)).collect(),
        tables: table("Drifts and steps", &header, findings.changed.iter().map(row).collect()),
        ..Section::default()
    }
}

fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", figure(value)) } else { figure(value) }
}

fn series<'a>(quantities: &'a [Quantity], it: &Changed) -> Option<(&'a Quantity, &'a Series)> {
    let quantity = quantities.iter().find(|of| of.name == it.quantity && of.unit == it.of)?;
    Some((quantity, quantity.series.iter().find(|series| series.unit == it.unit)?))
}

/// The unit's logs, what is fitted to them, and the other units behind them, each about its own mean: what does not change scatters about 0.
fn picture(quantities: &[Quantity], it: &Changed) -> Option<Plot> {
    let (quantity, series) = series(quantities, it)?;
    let points = about_mean(series);
    let xy = |points: &[Point]| points.iter().map(|it| (it.day, it.value)).unzip();
    let others =
        quantity.series.iter().filter(|other| other.unit != it.unit).flat_map(about_mean).collect::<Vec<_>>();
    let fitted: (Vec<f64>, Vec<f64>) = match it.kind {
        Kind::Drift => points.iter().map(|point| (point.day, Line::of(&points).at(point.day))).unzip(),
        Kind::Step => {
            let Step { first, levels: [before, after], .. } = Step::of(&points);
            let days =
                [points[0].day, points[first - 1].day, points[first].day, points[points.len() - 1].day];
            (days.to_vec(), vec![before, before, after, after])
        }
    };
    let curve = |label: &str, (x, y): (Vec<f64>, Vec<f64>), style: Style, role: Role| {
        outcome::Series::new(label, Curve { x, y }, style).of(role)
    };
    let kind = if it.kind == Kind::Drift { "drifts" } else { "steps" };
    Some(Plot {
        title: format!("Unit {}: {} {kind}", it.unit, it.quantity),
        caption: format!("{} ± {} {}, q = {:.1e}.", signed(it.change), figure(it.sigma), it.of, it.q),
        x_label: "time since the first log, days".into(),
        y_label: format!("{} about the unit's mean, {}", it.quantity, it.of),
        series: vec![
            curve("other units", xy(&others), Style::Hollow, Role::Measured),
            curve(&format!("unit {}", it.unit), xy(&points), Style::Points, Role::Extended),
            curve(kind, fitted, Style::Line, Role::Given),
        ],
        ..Plot::default()
    })
}

/// The points of a unit less their mean.
fn about_mean(series: &Series) -> Vec<Point> {
    let points = series.points();
    let middle = mean(&points).0;
    points.into_iter().map(|it| Point { value: it.value - middle, ..it }).collect()
}

/// A number of the model file is told against what the file says.
fn labelled(quantity: &str, unit: &str) -> String {
    if unit == "%" { format!("{quantity} against the model file, %") } else { format!("{quantity}, {unit}") }
}

fn units(quantities: &[Quantity], findings: &Findings) -> Section {
    let row = |it: &SpreadOf| {
        let within = |[low, high]: [f64; 2]| format!("{} … {}", figure(low), figure(high));
        let Spread { mean, mean_interval, between, between_interval, units } = it.spread;
        let figures = [figure(mean), within(mean_interval), figure(between), within(between_interval)];
        let [named, last] =
            [[&it.quantity, &it.unit].map(String::clone), [units.to_string(), figure(it.scatter)]];
        named.into_iter().chain(figures).chain(last).collect()
    };
    let header = ["number", "unit", "mean", "95 %", "between units", "95 %", "units", "scatter"];
    let text = "Mean and standard deviation of the units, without what single logs are uncertain by. Scatter: by how much the logs of a unit \
                differ, over what they tell; 1 where they tell it right. A number of the model file is told in per cent of what the file says.";
    let pictures = findings.spread.iter().filter_map(|it| side_by_side(quantities, it));
    Section {
        title: "Spread between units".into(),
        text: vec![text.into()],
        plots: pictures.collect(),
        tables: table("Numbers over units", &header, findings.spread.iter().map(row).collect()),
        ..Section::default()
    }
}

/// The units' means in ascending order, with the fleet's mean and spread.
fn side_by_side(quantities: &[Quantity], it: &SpreadOf) -> Option<Plot> {
    let quantity =
        quantities.iter().find(|quantity| quantity.name == it.quantity && quantity.unit == it.unit)?;
    let mut means: Vec<f64> = quantity.series.iter().map(|series| mean(&series.points()).0).collect();
    means.sort_by(f64::total_cmp);
    let last = means.len() as f64;
    let level = |label: &str, y: f64, role: Role| {
        outcome::Series::new(label, Curve { x: vec![1.0, last], y: vec![y; 2] }, Style::Dashed).of(role)
    };
    let x = (1..=means.len()).map(|k| k as f64).collect();
    let (mean, between, unit) = (it.spread.mean, it.spread.between, &it.unit);
    let [middle, spread] = [mean, between].map(figure);
    Some(Plot {
        title: format!("{} over units", it.quantity),
        caption: format!("Mean {middle}, standard deviation between units {spread} {unit}."),
        x_label: "unit, in ascending order".into(),
        y_label: labelled(&it.quantity, &it.unit),
        series: vec![
            outcome::Series::new("units", Curve { x, y: means }, Style::Points).of(Role::Extended),
            level("mean", mean, Role::Measured),
            level("mean − spread", mean - between, Role::Given),
            level("mean + spread", mean + between, Role::Given),
        ],
        ..Plot::default()
    })
}
