//! Plots as SVG text: curves on axes, and the gap per step as falling bars.

use super::format;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::error::Error;
use std::ops::Range;
use truing_core::outcome::{Curve, Plot, Role, Series, Step, Style};

type Drawn = Result<(), Box<dyn Error + Send + Sync>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Units of a drawing to a pixel: plotters rounds to whole units, and a line that is rounded to whole pixels jitters.
const FINE: i32 = 10;
/// More samples than this are thinned for drawing: twice the pixels.
const DRAWN_SAMPLES: usize = 1700;
/// Points of a measurement that are drawn.
const DRAWN_POINTS: usize = 390;

/// For which screen a plot is drawn. Letters have the same size on both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Screen {
    /// A desk: 860 pixels.
    Wide,
    /// A telephone: 360 pixels.
    Narrow,
}

impl Screen {
    /// Width and height, pixels.
    fn size(self) -> (u32, u32) {
        match self {
            Self::Wide => (860, 380),
            Self::Narrow => (360, 300),
        }
    }

    /// Labels on the abscissa and on the ordinate.
    fn labels(self) -> (usize, usize) {
        match self {
            Self::Wide => (11, 9),
            Self::Narrow => (6, 7),
        }
    }
}

/// A length in the units of a drawing.
const fn fine(pixels: i32) -> i32 {
    FINE * pixels
}

const INK: RGBColor = RGBColor(51, 65, 85);
const GRID: RGBColor = RGBColor(226, 232, 240);
const NOISE: RGBColor = RGBColor(203, 213, 225);
/// Ground of what was held out.
const HELD_OUT: RGBColor = RGBColor(241, 245, 249);
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
pub fn colour(series: &Series, index: usize) -> String {
    let RGBColor(r, g, b) = paint(series, index);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn paint(series: &Series, index: usize) -> RGBColor {
    let place = match series.role {
        Some(Role::Measured) => 0,
        Some(Role::Given) => 1,
        Some(Role::Extended) => 2,
        Some(Role::Further(k)) => 3 + k,
        None => index,
    };
    PALETTE[place % PALETTE.len()]
}

/// A plot as an SVG element; `None` if it holds no finite sample.
pub fn svg(plot: &Plot, screen: Screen) -> Option<String> {
    let window = Window::of(plot)?;
    let mut text = String::new();
    let (width, height) = screen.size();
    let area = SVGBackend::with_string(&mut text, fine_size((width, height))).into_drawing_area();
    draw(plot, &window, screen, area).ok()?;
    let names: Vec<&str> = plot.series.iter().map(|series| series.label.as_str()).collect();
    let about =
        format!("{}: {} over {}. Curves: {}.", plot.title, plot.y_label, plot.x_label, names.join(", "));
    Some(entitled(&text, (width, height), &about))
}

fn fine_size((width, height): (u32, u32)) -> (u32, u32) {
    (FINE as u32 * width, FINE as u32 * height)
}

/// The element with its size in pixels and with words for those who cannot see it.
fn entitled(svg: &str, (width, height): (u32, u32), about: &str) -> String {
    let (fine_width, fine_height) = fine_size((width, height));
    let about = about.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    let rest = svg.split_once('>').map_or("", |(_, rest)| rest);
    format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {fine_width} {fine_height}\" role=\"img\" aria-label=\"{about}\" xmlns=\"http://www.w3.org/2000/svg\"><title>{about}</title>{rest}"
    )
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

type Chart<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn draw(plot: &Plot, window: &Window, screen: Screen, area: Area) -> Drawn {
    let (columns, rows) = screen.labels();
    let mut chart = ChartBuilder::on(&area)
        .margin(fine(10))
        .margin_right(fine(24))
        .x_label_area_size(fine(44))
        .y_label_area_size(fine(if screen == Screen::Wide { 72 } else { 62 }))
        .build_cartesian_2d(window.x.clone(), window.y.clone())?;
    held_out(&mut chart, plot, window)?;
    noise_band(&mut chart, plot, window)?;
    chart
        .configure_mesh()
        .x_labels(columns)
        .y_labels(rows)
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID.stroke_width(FINE as u32))
        .axis_style(GRID.stroke_width(FINE as u32))
        .set_all_tick_mark_size(fine(5))
        .label_style(letters(14))
        .axis_desc_style(letters(15))
        .x_desc(&plot.x_label)
        .y_desc(&plot.y_label)
        .draw()?;
    marks(&mut chart, plot, window)?;
    for (k, series) in plot.series.iter().enumerate() {
        one_series(&mut chart, &series.curve, series.style, paint(series, k))?;
    }
    area.present()?;
    Ok(())
}

/// Sums of tick widths leave remainders such as 1e-17 where zero is meant.
fn tick(value: &f64) -> String {
    format::significant(if value.abs() < 1e-12 { 0.0 } else { *value }, 5)
}

/// Letters of a size in pixels.
fn letters(pixels: i32) -> TextStyle<'static> {
    ("sans-serif", fine(pixels)).into_font().color(&INK)
}

/// What was held out lies on a ground of its own.
fn held_out(chart: &mut Chart, plot: &Plot, window: &Window) -> Drawn {
    for (from, to) in &plot.held_out {
        let corners = [(*from, window.y.start), (*to, window.y.end)];
        chart.draw_series([Rectangle::new(corners, HELD_OUT.filled())])?;
    }
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
        let style = INK.mix(0.7).stroke_width(FINE as u32);
        chart.draw_series(DashedLineSeries::new(line, fine(3), fine(4), style))?;
        let right_half = *x > 0.5 * (window.x.start + window.x.end);
        let side = if right_half { HPos::Right } else { HPos::Left };
        let style = letters(14).pos(Pos::new(side, VPos::Top));
        // Neighbouring labels on different lines do not cover each other.
        let y = window.y.end - height * (0.02 + 0.06 * (k % 3) as f64);
        let padded = if right_half { format!("{label} ") } else { format!(" {label}") };
        chart.draw_series([Text::new(padded, (*x, y), style)])?;
    }
    Ok(())
}

fn one_series(chart: &mut Chart, curve: &Curve, style: Style, colour: RGBColor) -> Drawn {
    let line = colour.stroke_width(2 * FINE as u32);
    match style {
        Style::Points => points(chart, curve, colour.mix(0.85).filled(), fine(3))?,
        Style::Hollow => points(chart, curve, colour.stroke_width(FINE as u32), fine(4))?,
        Style::Line => {
            for piece in pieces(curve) {
                chart.draw_series(LineSeries::new(piece, line))?;
            }
        }
        Style::Dashed => {
            for piece in pieces(curve) {
                chart.draw_series(DashedLineSeries::new(piece, fine(7), fine(5), line))?;
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

const ROW: i32 = 34;
/// Height below the bars, pixels.
const FOOT: i32 = 26;

/// The gap after each step as falling bars, with the noise floor as a vertical line. `None` if there is no positive gap.
pub fn steps(steps: &[Step], floor: f64, unit: &str, screen: Screen) -> Option<String> {
    let largest =
        steps.iter().map(|s| s.gap).chain([floor]).filter(|gap| gap.is_finite()).reduce(f64::max)?;
    if steps.is_empty() || largest <= 0.0 {
        return None;
    }
    let size = (screen.size().0, ROW as u32 * steps.len() as u32 + FOOT as u32);
    let bars = Bars { steps, floor, unit, largest, screen };
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, fine_size(size)).into_drawing_area();
    bars.draw(area).ok()?;
    let told: Vec<String> =
        steps.iter().map(|step| format!("{}: {}", step.label, format::gap(step.gap))).collect();
    let about = format!("Gap per step in {unit}. {}. Noise floor: {}.", told.join("; "), format::gap(floor));
    Some(entitled(&text, size, &about))
}

/// Bars from nothing to the gap after each step.
struct Bars<'a> {
    steps: &'a [Step],
    floor: f64,
    unit: &'a str,
    largest: f64,
    screen: Screen,
}

impl Bars<'_> {
    /// Width of the labels and of the figures, pixels.
    fn margins(&self) -> (i32, i32) {
        match self.screen {
            Screen::Wide => (250, 110),
            Screen::Narrow => (140, 88),
        }
    }

    /// The end of a bar, in the units of the drawing.
    fn end(&self, gap: f64) -> i32 {
        let (labels, figures) = self.margins();
        let width = fine(self.screen.size().0 as i32 - labels - figures);
        fine(labels) + ((gap / self.largest).clamp(0.0, 1.0) * f64::from(width)) as i32
    }

    fn draw(&self, area: Area) -> Drawn {
        let text = |size: i32, side| letters(size).pos(Pos::new(side, VPos::Center));
        let labels = fine(self.margins().0);
        let bottom = fine(ROW * self.steps.len() as i32);
        for (k, step) in self.steps.iter().enumerate() {
            let y = fine(ROW * k as i32 + 4);
            let middle = y + fine(ROW / 2 - 3);
            let colour = if k == 0 { PALETTE[1] } else { PALETTE[2] };
            let (end, height) = (self.end(step.gap), fine(ROW - 10));
            area.draw(&Rectangle::new([(labels, y), (end, y + height)], colour.mix(0.85).filled()))?;
            let label = format::shortened(&step.label, if self.screen == Screen::Wide { 34 } else { 19 });
            area.draw(&Text::new(label, (labels - fine(10), middle), text(15, HPos::Right)))?;
            let gap = format!("{} {}", format::gap(step.gap), self.unit);
            let from = end.max(self.end(self.floor)) + fine(6);
            area.draw(&Text::new(gap, (from, middle), text(14, HPos::Left)))?;
        }
        if self.floor > 0.0 {
            let x = self.end(self.floor);
            let line = PALETTE[5].stroke_width(2 * FINE as u32);
            area.draw(&PathElement::new(vec![(x, 0), (x, bottom)], line))?;
            let label = format!("noise floor {} {}", format::gap(self.floor), self.unit);
            area.draw(&Text::new(label, (x + fine(4), bottom + fine(10)), text(14, HPos::Left)))?;
        }
        area.present()?;
        Ok(())
    }
}
