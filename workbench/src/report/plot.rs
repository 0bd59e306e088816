//! Plots as SVG text: curves on axes, and the gap per step as a waterfall.

use super::format;
use crate::outcome::{Curve, Plot, Step, Style};
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::error::Error;
use std::ops::Range;

type Drawn = Result<(), Box<dyn Error + Send + Sync>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Size of a plot in its own units; the page scales it.
const SIZE: (u32, u32) = (860, 380);
/// More samples than this are thinned for drawing: twice the pixels.
const DRAWN_SAMPLES: usize = 1700;
/// Points of a measurement that are drawn.
const DRAWN_POINTS: usize = 390;

const INK: RGBColor = RGBColor(51, 65, 85);
const GRID: RGBColor = RGBColor(226, 232, 240);
const NOISE: RGBColor = RGBColor(203, 213, 225);
/// Colours of measurement, given model, extended model, further curves.
const PALETTE: [RGBColor; 6] = [
    RGBColor(100, 116, 139),
    RGBColor(234, 88, 12),
    RGBColor(37, 99, 235),
    RGBColor(5, 150, 105),
    RGBColor(147, 51, 234),
    RGBColor(190, 18, 60),
];

/// Colour of the series at `index`, `#rrggbb`.
pub fn colour(index: usize) -> String {
    let RGBColor(r, g, b) = paint(index);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn paint(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

/// A plot as an SVG element; `None` if it holds no finite sample.
pub fn svg(plot: &Plot) -> Option<String> {
    let window = Window::of(plot)?;
    let mut text = String::new();
    draw(plot, &window, SVGBackend::with_string(&mut text, SIZE).into_drawing_area()).ok()?;
    Some(text)
}

/// The ranges of both axes.
struct Window {
    x: Range<f64>,
    y: Range<f64>,
}

impl Window {
    fn of(plot: &Plot) -> Option<Self> {
        let marks = plot.marks.iter().map(|m| m.0);
        let band = plot.noise_band.into_iter().flat_map(|b| [-b, b]);
        let x = spread(samples(plot).map(|(x, _)| x).chain(marks), 0.02)?;
        let y = spread(samples(plot).map(|(_, y)| y).chain(band), 0.06)?;
        Some(Window { x, y })
    }
}

fn samples(plot: &Plot) -> impl Iterator<Item = (f64, f64)> {
    plot.series.iter().flat_map(|s| finite(&s.curve))
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

/// An axis whose labels are short numbers.
#[derive(Clone)]
struct Axis(plotters::coord::types::RangedCoordf64);

impl Axis {
    fn new(range: Range<f64>) -> Self {
        Axis(range.into())
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.0.map(value, limit)
    }

    fn key_points<H: KeyPointHint>(&self, hint: H) -> Vec<f64> {
        self.0.key_points(hint)
    }

    fn range(&self) -> Range<f64> {
        self.0.range()
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(value: &f64) -> String {
        // Sums of tick widths leave remainders such as 1e-17 where zero is meant.
        format::significant(if value.abs() < 1e-12 { 0.0 } else { *value }, 5)
    }
}

type Chart<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<Axis, Axis>>;

fn draw(plot: &Plot, window: &Window, area: Area) -> Drawn {
    let mut chart = ChartBuilder::on(&area)
        .margin(10)
        .margin_right(24)
        .x_label_area_size(44)
        .y_label_area_size(72)
        .build_cartesian_2d(Axis::new(window.x.clone()), Axis::new(window.y.clone()))?;
    noise_band(&mut chart, plot, window)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(GRID)
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .axis_desc_style(("sans-serif", 15).into_font().color(&INK))
        .x_desc(&plot.x_label)
        .y_desc(&plot.y_label)
        .draw()?;
    marks(&mut chart, plot, window)?;
    for (k, series) in plot.series.iter().enumerate() {
        one_series(&mut chart, &series.curve, series.style, paint(k))?;
    }
    area.present()?;
    Ok(())
}

fn noise_band(chart: &mut Chart, plot: &Plot, window: &Window) -> Drawn {
    let Some(half) = plot.noise_band else {
        return Ok(());
    };
    let corners = [(window.x.start, -half), (window.x.end, half)];
    chart.draw_series([Rectangle::new(corners, NOISE.mix(0.45).filled())])?;
    Ok(())
}

fn marks(chart: &mut Chart, plot: &Plot, window: &Window) -> Drawn {
    let height = window.y.end - window.y.start;
    for (k, (x, label)) in plot.marks.iter().enumerate() {
        let line = [(*x, window.y.start), (*x, window.y.end)];
        chart.draw_series(DashedLineSeries::new(line, 3, 4, INK.mix(0.7).into()))?;
        let right_half = *x > 0.5 * (window.x.start + window.x.end);
        let side = if right_half { HPos::Right } else { HPos::Left };
        let style = ("sans-serif", 14).into_font().color(&INK).pos(Pos::new(side, VPos::Top));
        // Neighbouring labels on different lines do not cover each other.
        let y = window.y.end - height * (0.02 + 0.06 * (k % 3) as f64);
        let padded = if right_half { format!("{label} ") } else { format!(" {label}") };
        chart.draw_series([Text::new(padded, (*x, y), style)])?;
    }
    Ok(())
}

fn one_series(chart: &mut Chart, curve: &Curve, style: Style, colour: RGBColor) -> Drawn {
    match style {
        Style::Points => points(chart, curve, colour.mix(0.85).filled(), 3)?,
        Style::Hollow => points(chart, curve, colour.stroke_width(1), 4)?,
        Style::Line => {
            for piece in pieces(curve) {
                chart.draw_series(LineSeries::new(piece, colour.stroke_width(2)))?;
            }
        }
        Style::Dashed => {
            for piece in pieces(curve) {
                chart.draw_series(DashedLineSeries::new(piece, 7, 5, colour.stroke_width(2)))?;
            }
        }
    }
    Ok(())
}

fn points(chart: &mut Chart, curve: &Curve, style: ShapeStyle, radius: i32) -> Drawn {
    let all: Vec<_> = finite(curve).collect();
    let stride = all.len().div_ceil(DRAWN_POINTS).max(1);
    chart.draw_series(all.into_iter().step_by(stride).map(|p| Circle::new(p, radius, style)))?;
    Ok(())
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

const ROW: u32 = 34;
const LABELS: i32 = 250;
const FIGURES: i32 = 96;

/// The gap after each step as a waterfall on a logarithmic scale: each bar spans from the gap before to the gap after.
/// The noise floor is a vertical line. `None` if there is no positive gap.
pub fn waterfall(steps: &[Step], floor: f64, unit: &str) -> Option<String> {
    let scale = Decades::of(steps.iter().map(|s| s.gap).chain([floor]))?;
    let size = (SIZE.0, ROW * steps.len() as u32 + 46);
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
    draw_waterfall(steps, floor, unit, &scale, area).ok()?;
    Some(text)
}

/// A logarithmic scale in pixels between labels and figures.
struct Decades {
    low: f64,
    high: f64,
}

impl Decades {
    fn of(gaps: impl Iterator<Item = f64>) -> Option<Self> {
        let positive: Vec<f64> = gaps.filter(|g| g.is_finite() && *g > 0.0).collect();
        let high = positive.iter().copied().reduce(f64::max)?;
        let low = positive.iter().copied().fold(high, f64::min).max(high * 1e-6);
        Some(Decades { low: low * 0.6, high: high * 1.1 })
    }

    fn pixel(&self, gap: f64) -> i32 {
        let share = (gap.max(self.low) / self.low).ln() / (self.high / self.low).ln();
        let width = SIZE.0 as i32 - LABELS - FIGURES;
        LABELS + (share.clamp(0.0, 1.0) * f64::from(width)) as i32
    }
}

fn draw_waterfall(steps: &[Step], floor: f64, unit: &str, scale: &Decades, area: Area) -> Drawn {
    let text =
        |size: u32, side| ("sans-serif", size).into_font().color(&INK).pos(Pos::new(side, VPos::Center));
    let bottom = ROW as i32 * steps.len() as i32 + 6;
    let mut before = None;
    for (k, step) in steps.iter().enumerate() {
        let y = ROW as i32 * k as i32 + 4;
        let middle = y + ROW as i32 / 2 - 2;
        let (left, right, colour) = bar(scale, before, step.gap);
        area.draw(&Rectangle::new([(left, y), (right, y + ROW as i32 - 8)], colour.mix(0.85).filled()))?;
        area.draw(&Text::new(step.label.clone(), (LABELS - 10, middle), text(15, HPos::Right)))?;
        let gap = format!("{} {unit}", format::gap(step.gap));
        area.draw(&Text::new(gap, (right.max(scale.pixel(step.gap)) + 6, middle), text(14, HPos::Left)))?;
        before = Some(step.gap);
    }
    if floor > 0.0 {
        let x = scale.pixel(floor);
        area.draw(&PathElement::new(vec![(x, 0), (x, bottom)], PALETTE[5].stroke_width(2)))?;
        let label = format!("noise floor {} {unit}", format::gap(floor));
        area.draw(&Text::new(label, (x + 4, bottom + 14), text(14, HPos::Left)))?;
    }
    area.draw(&Text::new("logarithmic scale", (SIZE.0 as i32 - 8, bottom + 14), text(13, HPos::Right)))?;
    area.present()?;
    Ok(())
}

/// Left edge, right edge, colour: the first bar is the whole gap, a later one the part that a step took away or added.
fn bar(scale: &Decades, before: Option<f64>, gap: f64) -> (i32, i32, RGBColor) {
    let here = scale.pixel(gap);
    match before.map(|b| scale.pixel(b)) {
        None => (LABELS, here, PALETTE[1]),
        Some(there) if there >= here => (here, there, PALETTE[2]),
        Some(there) => (there, here, PALETTE[5]),
    }
}
