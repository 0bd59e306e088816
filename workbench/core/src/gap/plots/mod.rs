//! Curves for the report.

pub mod curve;

use crate::gap::dataset::Part;
use crate::gap::fit::hypothesis::Hypothesis;
use crate::gap::fit::samples::Sample;
use crate::gap::order::by_least;
use crate::outcome::{Curve, Plot, Role, Series, Stage, Style};
use std::collections::BTreeMap;

/// Most points of a curve. For display, chosen by judgement.
const POINTS: usize = 1500;
/// Pause between two runs in a plot over time, s. For display, chosen by judgement.
const RUN_GAP_S: f64 = 0.2;
/// Bins of a residual over an axis. For display, chosen by judgement.
const BINS: usize = 40;

/// All plots. `later`: what the second model is called; none where it is the given one.
pub fn all(given: &Hypothesis, before: &[Sample], after: &[Sample], later: Option<&str>) -> Vec<Plot> {
    let name = later.unwrap_or_default();
    let speed = if given.dataset.linear { "speed, m/s" } else { "speed, rad/s" };
    let compared = if given.dataset.of_position { &format!("way, {}", given.dataset.unit()) } else { speed };
    let band = Some(given.dataset.sigma);
    let mut plots = vec![
        traces(before, after, compared, name),
        over_speed([before, after], name, [speed, compared], band),
        in_time(before, after, compared, band, name),
    ];
    for plot in plots.iter_mut().filter(|_| later.is_none()) {
        plot.series.retain(|series| series.role != Some(Role::Extended));
    }
    plots
}

/// A value over time, run after run.
fn thinned(samples: &[Sample], value: impl Fn(&Sample) -> f64) -> Curve {
    let kept = samples.iter().step_by(samples.len().div_ceil(POINTS).max(1));
    let (mut run, mut start) = (None, 0.0);
    kept.fold(Curve::default(), |mut curve, sample| {
        // A new run breaks the line and follows behind the last.
        if run.is_some_and(|before| before != sample.run) {
            start = curve.x.last().map_or(0.0, |last| last + RUN_GAP_S);
            curve.x.push(f64::NAN);
            curve.y.push(f64::NAN);
        }
        run = Some(sample.run);
        curve.x.push(start + sample.time);
        curve.y.push(value(sample));
        curve
    })
}

/// Runs in the first picture at most: more would show nothing but hairs. For display, chosen by judgement.
const SHOWN_RUNS: usize = 12;

/// Measured and simulated over time, what was held out marked.
fn traces(before: &[Sample], after: &[Sample], speed: &str, later: &str) -> Plot {
    let (runs, all) = shown_runs(before);
    let left_out = match runs.len() < all {
        true => {
            format!(". Shown are {} of {all} runs: those that the model as given misses most", runs.len())
        }
        false => String::new(),
    };
    let of = |samples: &[Sample]| -> Vec<Sample> {
        samples.iter().filter(|sample| runs.contains(&sample.run)).copied().collect()
    };
    let (before, after) = (of(before), of(after));
    let measured = thinned(&before, |s| s.measured);
    let held_out = thinned(&before, |s| f64::from(u8::from(s.part == Part::HoldOut)));
    Plot {
        title: "Measured and simulated".into(),
        caption: format!(
            "Free run over measured points, the runs one after another. What is shaded was held out{left_out}"
        ),
        stage: Stage::Overview,
        x_label: "time, s".into(),
        y_label: speed.into(),
        held_out: stretches(&held_out),
        series: vec![
            Series::new(later, thinned(&after, |s| s.predicted), Style::Line).of(Role::Extended),
            Series::new("model as given", thinned(&before, |s| s.predicted), Style::Dashed).of(Role::Given),
            Series::new("measured", measured, Style::Points).of(Role::Measured),
        ],
        ..Plot::default()
    }
}

/// The runs that the model as given misses most, in their order, and how many there are.
fn shown_runs(samples: &[Sample]) -> (Vec<usize>, usize) {
    let mut missed: BTreeMap<usize, f64> = BTreeMap::new();
    for sample in samples {
        *missed.entry(sample.run).or_default() += sample.residual().powi(2);
    }
    let mut runs: Vec<(usize, f64)> = missed.into_iter().collect();
    let all = runs.len();
    by_least(&mut runs, |it| -it.1);
    runs.truncate(SHOWN_RUNS);
    (runs.into_iter().map(|(run, _)| run).collect(), all)
}

/// The stretches in which a curve of zeros and ones is one.
fn stretches(held_out: &Curve) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    let mut inside = false;
    for (x, y) in held_out.x.iter().zip(&held_out.y) {
        match (*y == 1.0, found.last_mut()) {
            (true, Some(last)) if inside => last.1 = *x,
            (true, _) => found.push((*x, *x)),
            _ => {}
        }
        inside = *y == 1.0;
    }
    found
}

fn over_speed([before, after]: [&[Sample]; 2], later: &str, [x, y]: [&str; 2], band: Option<f64>) -> Plot {
    // Means of the residual over quantile bins.
    let binned =
        |samples: &[Sample]| Curve::binned(samples.iter().map(|s| (s.omega, s.residual())).collect(), BINS);
    Plot {
        title: "Residual over the simulated speed".into(),
        caption: "Means over bins of the simulation, never of the measurement; the band is the noise".into(),
        stage: Stage::Characterisation,
        x_label: x.into(),
        y_label: format!("measured − simulated {y}"),
        series: vec![
            Series::new("model as given", binned(before), Style::Points).of(Role::Given),
            Series::new(later, binned(after), Style::Line).of(Role::Extended),
        ],
        noise_band: band,
        ..Plot::default()
    }
}

fn in_time(before: &[Sample], after: &[Sample], speed: &str, band: Option<f64>, later: &str) -> Plot {
    Plot {
        title: "Residual over time".into(),
        caption: "What the model as given misses, and what is left at the end; the runs one after another"
            .into(),
        stage: Stage::Detection,
        x_label: "time, s".into(),
        y_label: format!("measured − simulated {speed}"),
        series: vec![
            Series::new("model as given", thinned(before, Sample::residual), Style::Dashed).of(Role::Given),
            Series::new(later, thinned(after, Sample::residual), Style::Line).of(Role::Extended),
        ],
        noise_band: band,
        ..Plot::default()
    }
}
