//! A plot as the data of a chart that a page's script draws (`charts.js`).

use super::plot::{Window, ink, visible};
use serde_json::{Value, json};
use std::ops::Range;
use truing_core::outcome::{Plot, Series};

/// Steps of an axis at least: some twenty to a pixel of the whole, which is enough for what is thinned to the pixels.
const FINENESS: f64 = 1e4;

/// The data, `None` if they hold no finite sample. Numbers are whole steps, each less the one before: three letters instead of eight. A name out
/// of a user's file cannot end the element in which the data stand.
pub fn data(plot: &Plot) -> Option<String> {
    let window = Window::of(plot)?;
    let steps = [step(&window.x), step(&window.y)];
    let shown = plot.series.iter().enumerate().filter(|(_, series)| !series.curve.x.is_empty());
    let data = json!({
        "axes": [plot.x_label, plot.y_label],
        "steps": steps,
        "band": plot.noise_band,
        "marks": plot.marks,
        "held": plot.held_out,
        "series": shown.map(|(k, series)| one(series, ink(series, k), steps)).collect::<Vec<Value>>(),
    });
    Some(data.to_string().replace('<', "\\u003c"))
}

/// A power of ten, of which the range holds many.
fn step(range: &Range<f64>) -> f64 {
    10f64.powf(((range.end - range.start) / FINENESS).log10().floor())
}

fn one(series: &Series, ink: usize, [x_step, y_step]: [f64; 2]) -> Value {
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for piece in visible(series) {
        if let (Some(last), Some(first)) = (x.last().copied(), piece.first()) {
            // A break stands between the pieces.
            x.push(0.5 * (last + first.0));
            y.push(None);
        }
        x.extend(piece.iter().map(|point| point.0));
        y.extend(piece.iter().map(|point| Some(point.1)));
    }
    let style = format!("{:?}", series.style).to_lowercase();
    let x = differences(x.into_iter().map(Some), x_step);
    json!({ "label": series.label, "ink": ink, "style": style, "x": x, "y": differences(y.into_iter(), y_step) })
}

/// Whole steps, each less the one before; breaks stay.
fn differences(values: impl Iterator<Item = Option<f64>>, step: f64) -> Vec<Option<i64>> {
    let mut before = 0;
    let mut less = |value: f64| {
        let now = (value / step).round() as i64;
        now - std::mem::replace(&mut before, now)
    };
    values.map(|value| value.map(&mut less)).collect()
}
