//! One page about what was tried: the model's gap in simulation, the motor's error on the bench, what was kept.

use crate::history::{Entry, Known};
use crate::improving::Improved;
use crate::trial::{Compared, Trial};
use truing_core::outcome::{Curve, Plot, Role, Series, Style};
use truing_report::report::html::Document;
use truing_report::report::section::{Section, Table};

/// The page.
pub fn page(improved: &Improved, command: &str) -> Document {
    let verdict = if improved.improved { "The servo follows better" } else { "The servo is as it was" };
    let subtitle = format!("{}; the motor was under way for {:.1} s", improved.why, improved.motor_s);
    let document = Document::new(verdict, subtitle).by(command).section(summary(improved));
    (1..).zip(&improved.outcomes).fold(document, |page, (round, outcome)| {
        page.gap(format!("What the log of round {round} shows"), &[], outcome)
    })
}

const HOW: &str = "Each candidate was put in force beside the stored parameters, the motor followed the same motions with the old \
                   and the new numbers in turns, and only what follows better beyond doubt was stored.";

/// What was tried, and what it brought.
pub fn summary(improved: &Improved) -> Section {
    Section {
        title: "What was tried".into(),
        text: vec![HOW.into()],
        plots: [gaps(improved), errors(improved)].into_iter().flatten().collect(),
        tables: vec![table(&improved.entries)],
        ..Section::default()
    }
}

const HEADER: [&str; 7] = ["no.", "names", "fit of the model", "numbers", "error", "outcome", "why"];

fn table(entries: &[Entry]) -> Table {
    let row = |(number, entry): (usize, &Entry)| {
        let fit = entry.gap.as_ref().and_then(|gap| Some((gap.fit_percent[0]?, gap.fit_percent[1]?)));
        // Of what a model tells the loops no interval is known here.
        let sure = |u95: f64| if u95 > 0.0 { format!(" ± {u95:.4}") } else { String::new() };
        let told = |it: &Known| format!("{} {:.4}{} {}", it.name, it.value, sure(it.u95), it.unit);
        vec![
            number.to_string(),
            entry.names.join(", "),
            fit.map_or("–".into(), |(before, after)| format!("{before:.2} → {after:.2} %")),
            entry.numbers.iter().map(told).collect::<Vec<_>>().join("; "),
            entry.trial.as_ref().map_or("–".into(), |it| it.text("; ")),
            entry.became().into(),
            entry.why.clone(),
        ]
    };
    Table {
        caption: "Candidates in the order of their trials".into(),
        header: HEADER.map(String::from).to_vec(),
        rows: (1..).zip(entries).map(row).collect(),
    }
}

/// The model's gap before and after each round; a single one is told by the table.
fn gaps(improved: &Improved) -> Option<Plot> {
    let mut gaps = improved.entries.iter().filter_map(|entry| entry.gap.as_ref());
    let all: Vec<[f64; 3]> =
        gaps.clone().filter_map(|gap| Some([gap.rms[0]?, gap.rms[1]?, gap.rms[2]?])).collect();
    let unit = gaps.next_back().filter(|_| all.len() > 1)?.unit.clone();
    let curve = |which: usize| Curve {
        x: (1..=all.len()).map(|number| number as f64).collect(),
        y: all.iter().map(|rms| rms[which]).collect(),
    };
    Some(Plot {
        title: "Gap between model and log, on data held out".into(),
        x_label: "candidate".into(),
        y_label: format!("rms, {unit}"),
        series: vec![
            Series::new("model as given", curve(0), Style::Points).of(Role::Given),
            Series::new("extended model", curve(1), Style::Points).of(Role::Extended),
            Series::new("noise floor", curve(2), Style::Dashed),
        ],
        ..Plot::default()
    })
}

/// The motor's error, run by run.
fn errors(improved: &Improved) -> Option<Plot> {
    let trials: Vec<&Trial> = improved.entries.iter().filter_map(|entry| entry.trial.as_ref()).collect();
    let kinds = trials.first()?.motions.iter().enumerate();
    let curve = |kind: usize, rms: fn(&Compared) -> &Vec<f64>| {
        let runs = trials.iter().flat_map(|trial| rms(&trial.motions[kind]));
        let y: Vec<f64> = runs.map(|rms| rms.to_degrees()).collect();
        Curve { x: (1..=y.len()).map(|pair| pair as f64).collect(), y }
    };
    let series = kinds.flat_map(|(kind, Compared { motion, .. })| {
        let named =
            |whose: &str, curve, style| Series::new(&format!("{}, {whose}", motion.name), curve, style);
        let old = named("old numbers", curve(kind, |it| &it.old_rms_rad), Style::Hollow);
        [old, named("new numbers", curve(kind, |it| &it.new_rms_rad), Style::Points)]
    });
    Some(Plot {
        title: "Position error of the motor, run by run".into(),
        x_label: "pair of runs".into(),
        y_label: "rms, °".into(),
        series: series.collect(),
        ..Plot::default()
    })
}
