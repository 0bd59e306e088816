//! The plots of a report as SVG files of their own, for a document that shows some of them.

use super::plot::{Screen, steps, svg};
use super::write_atomically;
use anyhow::Result;
use std::path::Path;
use truing_core::outcome::Outcome;

/// Writes every plot of an outcome into a folder, named by its title, and the gap per step as `gap.svg`.
pub fn write(outcome: &Outcome, folder: &Path) -> Result<()> {
    let plots = outcome.plots.iter().filter_map(|plot| Some((slug(&plot.title), svg(plot, Screen::Wide)?)));
    let floor = outcome.holdout.noise_floor;
    let bars = steps(&outcome.steps, floor, &outcome.gap_unit, Screen::Wide);
    let bars = bars.map(|text| ("gap".to_owned(), text));
    for (name, text) in plots.chain(bars) {
        write_atomically(&folder.join(name + ".svg"), &on_white(&text))?;
    }
    Ok(())
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
