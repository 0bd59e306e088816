//! Plots as SVG text: curves on axes, as a page shows them where no script runs, and on paper.

use super::format;
use maud::{Markup, html};
use std::ops::Range;
use truing_core::outcome::{Curve, Plot, Role, Series, Style};

/// More samples than this are thinned for drawing: twice the pixels.
const DRAWN_SAMPLES: usize = 1700;
/// Points of a measurement that are drawn.
const DRAWN_POINTS: usize = 390;
/// Width and height, pixels.
const SIZE: (u32, u32) = (860, 380);
/// Left, top, right and bottom edge of the axes in it.
const FRAME: [f64; 4] = [82.0, 10.0, 836.0, 326.0];

const LETTERS: &str = "#334155";
const GRID: &str = "#E2E8F0";
const NOISE: &str = "#E5E9F0";
/// Ground of what was held out.
const HELD_OUT: &str = "#F1F5F9";
/// Colours of measurement, given model, extended model, further curves; a page changes them by these letters where it is dark.
const PALETTE: [&str; 6] = ["#64748B", "#EA580C", "#2563EB", "#059669", "#9333EA", "#BE123C"];
/// What they are called in the style sheet of a page.
pub const INKS: [&str; 6] = ["measured", "given", "extended", "third", "fourth", "fifth"];

/// Place of a series in the palette.
pub fn ink(series: &Series, index: usize) -> usize {
    let place = match series.role {
        Some(Role::Measured) => 0,
        Some(Role::Given) => 1,
        Some(Role::Extended) => 2,
        Some(Role::Further(k)) => 3 + k,
        None => index,
    };
    place % PALETTE.len()
}

/// A plot as an SVG element, with words for those who cannot see it; `None` if it holds no finite sample.
pub fn svg(plot: &Plot) -> Option<String> {
    let window = Window::of(plot)?;
    let Window { x, y } = &window;
    let names: Vec<&str> = plot.series.iter().map(|series| series.label.as_str()).collect();
    let about =
        format!("{}: {} over {}. Curves: {}.", plot.title, plot.y_label, plot.x_label, names.join(", "));
    let picture = html! {
        svg width=(SIZE.0) height=(SIZE.1) viewBox=(format!("0 0 {} {}", SIZE.0, SIZE.1)) role="img" aria-label=(about)
            xmlns="http://www.w3.org/2000/svg" font-family="sans-serif" font-size="14" {
            title { (about) }
            @for (from, to) in &plot.held_out { (ground(&window, [*from, *to], [y.start, y.end], HELD_OUT)) }
            @if let Some(half) = plot.noise_band { (ground(&window, [x.start, x.end], [-half, half], NOISE)) }
            (axes(plot, &window))
            @for (k, mark) in plot.marks.iter().enumerate() { (marked(&window, mark, k)) }
            @for (k, series) in plot.series.iter().enumerate() { (curve(&window, series, PALETTE[ink(series, k)])) }
        }
    };
    Some(picture.into_string())
}

/// The ranges of both axes.
pub(super) struct Window {
    pub x: Range<f64>,
    pub y: Range<f64>,
}

impl Window {
    pub fn of(plot: &Plot) -> Option<Self> {
        let samples = || plot.series.iter().flat_map(|s| finite(&s.curve));
        let marks = plot.marks.iter().map(|m| m.0);
        let band = plot.noise_band.into_iter().flat_map(|b| [-b, b]);
        let x = spread(samples().map(|(x, _)| x).chain(marks), 0.02)?;
        let y = spread(samples().map(|(_, y)| y).chain(band), 0.06)?;
        Some(Window { x, y })
    }

    /// Pixels to the right and down.
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let [left, top, right, bottom] = FRAME;
        let share = |range: &Range<f64>, value: f64| (value - range.start) / (range.end - range.start);
        (left + (right - left) * share(&self.x, x), bottom - (bottom - top) * share(&self.y, y))
    }
}

fn finite(curve: &Curve) -> impl Iterator<Item = (f64, f64)> {
    curve.x.iter().copied().zip(curve.y.iter().copied()).filter(|(x, y)| x.is_finite() && y.is_finite())
}

/// The range of the values with a margin on both sides.
fn spread(values: impl Iterator<Item = f64>, margin: f64) -> Option<Range<f64>> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return None;
    }
    let width = (high - low).max(1e-9 * (low.abs() + high.abs())).max(1e-12);
    Some(low - margin * width..high + margin * width)
}

/// What was held out, and the noise, lie on grounds of their own.
fn ground(window: &Window, [from, to]: [f64; 2], [low, high]: [f64; 2], colour: &str) -> Markup {
    let ((left, top), (right, bottom)) = (window.at(from, high), window.at(to, low));
    html! { rect x=(one(left)) y=(one(top)) width=(one(right - left)) height=(one(bottom - top)) fill=(colour) {} }
}

/// A length to a tenth of a pixel.
fn one(pixels: f64) -> String {
    format!("{pixels:.1}")
}

/// A path from point to point.
fn path(points: impl Iterator<Item = (f64, f64)>, window: &Window, between: &str) -> String {
    let pixels = points.map(|(x, y)| window.at(x, y));
    pixels.map(|(x, y)| format!("{x:.1} {y:.1}")).collect::<Vec<String>>().join(between)
}

/// Lines, figures and names.
fn axes(plot: &Plot, window: &Window) -> Markup {
    let [left, top, right, bottom] = FRAME;
    let across = ticks(&window.x, 10.0).into_iter().map(|x| (window.at(x, 0.0).0, tick(x)));
    let up = ticks(&window.y, 8.0).into_iter().map(|y| (window.at(0.0, y).1, tick(y)));
    let turned = format!("translate(18 {}) rotate(-90)", 0.5 * (top + bottom));
    html! {
        g fill=(LETTERS) text-anchor="middle" {
            @for (x, text) in across {
                path d=(format!("M{x:.1} {top}V{bottom}")) stroke=(GRID) {} text x=(one(x)) y=(bottom + 18.0) { (text) }
            }
            text x=(0.5 * (left + right)) y=(bottom + 42.0) { (plot.x_label) }
            text transform=(turned) { (plot.y_label) }
        }
        g fill=(LETTERS) text-anchor="end" {
            @for (y, text) in up {
                path d=(format!("M{left} {y:.1}H{right}")) stroke=(GRID) {} text x=(left - 6.0) y=(one(y + 5.0)) { (text) }
            }
        }
    }
}

/// Round values inside a range, about so many.
fn ticks(range: &Range<f64>, about: f64) -> Vec<f64> {
    let rough = (range.end - range.start) / about;
    let ten = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0].map(|round| round * ten).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(10.0 * ten);
    let (first, last) = ((range.start / step).ceil() as i64, (range.end / step).floor() as i64);
    (first..=last).map(|k| k as f64 * step).collect()
}

/// Products of steps leave remainders where a round number is meant.
fn tick(value: f64) -> String {
    format::significant(if value.abs() < 1e-12 { 0.0 } else { value }, 5)
}

/// A vertical mark; the labels of neighbours are on different lines and do not cover each other.
fn marked(window: &Window, (x, label): &(f64, String), k: usize) -> Markup {
    let [left, top, right, bottom] = FRAME;
    let at = window.at(*x, 0.0).0;
    let (side, beside) = if at > 0.5 * (left + right) { ("end", -5.0) } else { ("start", 5.0) };
    html! {
        path d=(format!("M{at:.1} {top}V{bottom}")) stroke=(LETTERS) stroke-dasharray="3 4" {}
        text x=(one(at + beside)) y=(top + 14.0 + 20.0 * (k % 3) as f64) fill=(LETTERS) text-anchor=(side) { (label) }
    }
}

fn curve(window: &Window, series: &Series, colour: &str) -> Markup {
    let dots = matches!(series.style, Style::Points | Style::Hollow);
    let of = |piece: Vec<(f64, f64)>| path(piece.into_iter(), window, if dots { "h0M" } else { "L" });
    let pieces: Vec<String> = visible(series).into_iter().map(of).collect();
    // A point is a line of no length with round ends.
    let drawn = format!("M{}{}", pieces.join("M"), if dots { "h0" } else { "" });
    let (width, dashes) = (if dots { 6 } else { 2 }, (series.style == Style::Dashed).then_some("7 5"));
    html! {
        @if pieces.iter().any(|piece| !piece.is_empty()) {
            path d=(drawn) fill="none" stroke=(colour) stroke-width=(width) stroke-linecap=[dots.then_some("round")] stroke-dasharray=[dashes] {}
            @if series.style == Style::Hollow { path d=(drawn) stroke="var(--page, #fff)" stroke-width="4" stroke-linecap="round" {} }
        }
    }
}

/// What is drawn of a series: its unbroken pieces, or some of its points.
pub(super) fn visible(series: &Series) -> Vec<Vec<(f64, f64)>> {
    if matches!(series.style, Style::Line | Style::Dashed) {
        return pieces(&series.curve);
    }
    let all: Vec<_> = finite(&series.curve).collect();
    let stride = all.len().div_ceil(DRAWN_POINTS).max(1);
    vec![all.into_iter().step_by(stride).collect()]
}

/// The unbroken pieces of a curve, thinned to what can be seen.
fn pieces(curve: &Curve) -> Vec<Vec<(f64, f64)>> {
    let all: Vec<_> = curve.x.iter().copied().zip(curve.y.iter().copied()).collect();
    let unbroken = all.split(|(x, y)| !(x.is_finite() && y.is_finite()));
    unbroken.filter(|p| !p.is_empty()).map(thinned).collect()
}

/// Keeps the lowest and the highest sample of each stretch, so that peaks stay visible.
fn thinned(piece: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if piece.len() <= DRAWN_SAMPLES {
        return piece.to_vec();
    }
    piece.chunks(piece.len().div_ceil(DRAWN_SAMPLES / 2)).flat_map(extremes).collect()
}

fn extremes(chunk: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let by_height = |a: &usize, b: &usize| chunk[*a].1.total_cmp(&chunk[*b].1);
    let low = (0..chunk.len()).min_by(by_height).unwrap_or(0);
    let high = (0..chunk.len()).max_by(by_height).unwrap_or(0);
    let mut kept = vec![low.min(high), low.max(high)];
    kept.dedup();
    kept.into_iter().map(|k| chunk[k]).collect()
}
