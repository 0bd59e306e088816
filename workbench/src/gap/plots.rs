//! Curves for the report.

use crate::gap::dataset::Part;
use crate::gap::hypothesis::Hypothesis;
use crate::gap::samples::{Sample, samples};
use crate::gap::search::Scored;
use crate::outcome::{Curve, Plot, Series, Stage, Style};

/// Most points of a curve.
const POINTS: usize = 1500;
/// Pause between two runs in a plot over time, s.
const RUN_GAP_S: f64 = 0.2;
/// Bins of a residual over an axis.
const BINS: usize = 40;

/// All plots.
pub fn all(given: &Hypothesis, x: &[f64], kept: &Scored) -> Vec<Plot> {
    const ALL: &[Part] = &[Part::A, Part::B, Part::HoldOut];
    let before = samples(given, x, ALL);
    let after = samples(&kept.hypothesis, &kept.fit.x, ALL);
    let linear = given.dataset.linear;
    let (speed, input) = (
        if linear { "speed, m/s" } else { "speed, rad/s" },
        format!("input, {}", given.dataset.input.unit()),
    );
    let compared = match given.dataset.of_position {
        true => &format!("way, {}", given.dataset.unit()),
        false => speed,
    };
    let band = Some(given.dataset.sigma);
    vec![
        traces(&before, &after, compared),
        over(&before, &after, "Residual over the input", &input, compared, band, &|s| s.input),
        over(&before, &after, "Residual over the simulated speed", speed, compared, band, &|s| s.omega),
        in_time(&before, &after, compared, band),
    ]
}

/// A value over time, run after run.
fn thinned(samples: &[Sample], value: impl Fn(&Sample) -> f64) -> Curve {
    let every = samples.len().div_ceil(POINTS).max(1);
    let kept = samples.iter().step_by(every);
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

/// Measured and simulated held-out data (all data when none is in the first run).
fn traces(before: &[Sample], after: &[Sample], speed: &str) -> Plot {
    let shown = |samples: &[Sample]| -> Vec<Sample> {
        let last = samples.last().map_or(0, |s| s.run);
        samples.iter().filter(|s| s.run == last).copied().collect()
    };
    let (before, after) = (shown(before), shown(after));
    Plot {
        title: "Measured and simulated".into(),
        caption: "Free run over the last run of the data: the model as given, and with what was missing"
            .into(),
        stage: Stage::Extraction,
        x_label: "time, s".into(),
        y_label: speed.into(),
        series: vec![
            Series::new("measured", thinned(&before, |s| s.measured), Style::Points),
            Series::new("model as given", thinned(&before, |s| s.predicted), Style::Dashed),
            Series::new("extended model", thinned(&after, |s| s.predicted), Style::Line),
        ],
        ..Plot::default()
    }
}

fn over(
    before: &[Sample],
    after: &[Sample],
    title: &str,
    x: &str,
    y: &str,
    band: Option<f64>,
    axis: &dyn Fn(&Sample) -> f64,
) -> Plot {
    Plot {
        title: title.into(),
        caption: "Means over bins of the simulation, never of the measurement; the band is the noise".into(),
        stage: Stage::Characterisation,
        x_label: x.into(),
        y_label: format!("measured − simulated {y}"),
        series: vec![
            Series::new("model as given", binned(before, axis), Style::Points),
            Series::new("extended model", binned(after, axis), Style::Line),
        ],
        noise_band: band,
        ..Plot::default()
    }
}

/// Means of the residual over quantile bins of an axis.
fn binned(samples: &[Sample], axis: &dyn Fn(&Sample) -> f64) -> Curve {
    let mut order: Vec<&Sample> = samples.iter().collect();
    order.sort_by(|a, b| axis(a).total_cmp(&axis(b)));
    let mean = |bin: &[&Sample], value: &dyn Fn(&Sample) -> f64| {
        bin.iter().map(|s| value(s)).sum::<f64>() / bin.len() as f64
    };
    let bins: Vec<&[&Sample]> = order.chunks(order.len().div_ceil(BINS).max(1)).collect();
    Curve {
        x: bins.iter().map(|bin| mean(bin, axis)).collect(),
        y: bins.iter().map(|bin| mean(bin, &Sample::residual)).collect(),
    }
}

fn in_time(before: &[Sample], after: &[Sample], speed: &str, band: Option<f64>) -> Plot {
    Plot {
        title: "Residual over time".into(),
        caption: "What the model as given misses, and what is left at the end; the runs one after another"
            .into(),
        stage: Stage::Detection,
        x_label: "time, s".into(),
        y_label: format!("measured − simulated {speed}"),
        series: vec![
            Series::new("model as given", thinned(before, Sample::residual), Style::Dashed),
            Series::new("extended model", thinned(after, Sample::residual), Style::Line),
        ],
        noise_band: band,
        ..Plot::default()
    }
}
