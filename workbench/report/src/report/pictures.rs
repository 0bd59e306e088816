//! The plots of a report as SVG files of their own, for a document that shows some of them.

use super::plot::svg;
use super::write_atomically;
use anyhow::Result;
use std::path::Path;
use truing_core::outcome::{Curve, Outcome, Plot, Role, Series, Style};

/// Writes every plot of an outcome into a folder, named by its title, and the gap per step as `gap.svg`.
pub fn write(outcome: &Outcome, folder: &Path) -> Result<()> {
    let steps = (!outcome.steps.is_empty()).then(|| gap(outcome));
    for plot in outcome.plots.iter().chain(steps.as_ref()) {
        if let Some(text) = svg(plot) {
            write_atomically(&folder.join(slug(&plot.title) + ".svg"), &on_white(&text))?;
        }
    }
    Ok(())
}

/// The gap after each step above the noise floor.
fn gap(outcome: &Outcome) -> Plot {
    let over = |y: Vec<f64>| Curve { x: (0..y.len()).map(|k| k as f64).collect(), y };
    let floor = vec![outcome.holdout.noise_floor; outcome.steps.len()];
    let gaps = outcome.steps.iter().map(|step| step.gap).collect();
    Plot {
        title: "Gap".into(),
        x_label: "step".into(),
        y_label: format!("gap on held-out data, {}", outcome.gap_unit),
        series: vec![
            Series::new("noise floor", over(floor), Style::Dashed).of(Role::Measured),
            Series::new("gap", over(gaps), Style::Line).of(Role::Extended),
        ],
        marks: outcome.steps.iter().enumerate().map(|(k, step)| (k as f64, step.label.clone())).collect(),
        ..Plot::default()
    }
}

/// A page gives its plots a ground; a picture alone brings its own, or dark pages swallow its letters.
fn on_white(svg: &str) -> String {
    let end = svg.find('>').map_or(0, |end| end + 1);
    let (head, rest) = svg.split_at(end);
    format!("{head}<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>{rest}")
}

/// A title as a file's name: `Residual over the input` becomes `residual-over-the-input`.
fn slug(title: &str) -> String {
    let words = title.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-").to_lowercase()
}
