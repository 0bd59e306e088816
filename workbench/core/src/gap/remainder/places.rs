//! Where simulation and data disagree: the regions of input, speed, direction, acceleration, current, time since
//! reversal and time in which the missing torque is concentrated.
//!
//! The missing torque J·ė + D·e of a linear base is exact (superposition), and unlike the residual it is not smeared
//! over a time constant. A region is worth telling when it holds much more of the squared torque than of the samples.

use super::words::unit;
use crate::gap::fit::hypothesis::Hypothesis;
use crate::gap::fit::samples::Sample;
use crate::gap::order::by_least;
use crate::outcome::Where;
use crate::system::log::Input;
use crate::system::model::Kind;
use crate::system::plant::unnamed::Variable;
use crate::text::figures::figure;

/// Regions that are told. For display, chosen by judgement.
const TOLD: usize = 3;
/// A region must hold this much more of the error than of the samples. Chosen by judgement; not studied.
const CONCENTRATED: f64 = 0.15;

/// The quantities over which it is looked at, as a reader knows their magnitudes.
const AXES: [(Variable, &str); 6] = [
    (Variable::Input, "|u|"),
    (Variable::Speed, "|speed|"),
    (Variable::Acceleration, "|acceleration|"),
    (Variable::TimeSinceReversal, "time since reversal"),
    (Variable::Time, "time"),
    (Variable::Current, "|current|"),
];

/// A quantity over which the missing torque is looked at.
struct Axis {
    name: &'static str,
    unit: &'static str,
    values: Vec<f64>,
}

/// Two regions are one if so much of the squared error that lies in either lies in both: a step, the first moments
/// after it and a large acceleration are the same rows. Chosen by judgement; not studied.
const THE_SAME: f64 = 0.8;

/// A stretch of an axis: below or above a value.
struct Region {
    text: String,
    share: f64,
    concentration: f64,
    inside: Vec<bool>,
    also: Vec<String>,
}

impl Region {
    fn new(text: String, inside: impl Iterator<Item = bool>, squares: &[f64]) -> Self {
        let inside: Vec<bool> = inside.collect();
        let held = inside.iter().zip(squares).filter(|(inside, _)| **inside);
        let share: f64 = held.map(|(_, square)| square).sum();
        let part = inside.iter().filter(|inside| **inside).count() as f64 / inside.len() as f64;
        Self { text, share, concentration: share - part, inside, also: Vec::new() }
    }

    fn same(&self, other: &Self, squares: &[f64]) -> bool {
        let (mut both, mut either) = (0.0, 0.0);
        for ((a, b), square) in self.inside.iter().zip(&other.inside).zip(squares) {
            both += if *a && *b { *square } else { 0.0 };
            either += if *a || *b { *square } else { 0.0 };
        }
        both > THE_SAME * either
    }
}

/// The regions that hold more than their part, most concentrated first.
pub fn places(given: &Hypothesis, (samples, since_reversal): &(Vec<Sample>, Vec<f64>)) -> Vec<Where> {
    let total: f64 = samples.iter().map(|s| s.torque * s.torque).sum();
    if samples.len() < 50 || total <= 0.0 {
        return Vec::new();
    }
    let squares: Vec<f64> = samples.iter().map(|s| s.torque * s.torque / total).collect();
    let mut regions: Vec<Region> =
        axes(given, samples, since_reversal).iter().filter_map(|axis| densest(axis, &squares)).collect();
    regions.extend(direction(samples, &squares));
    regions.retain(|region| region.concentration > CONCENTRATED);
    by_least(&mut regions, |it| -it.concentration);
    let mut told: Vec<Region> = Vec::new();
    for region in regions {
        match told.iter_mut().find(|known| known.same(&region, &squares)) {
            Some(known) => known.also.push(region.text),
            None => told.push(region),
        }
    }
    told.truncate(TOLD);
    let place = |region: Region| Where {
        region: region.text,
        share_of_squared_error: region.share,
        also: region.also,
    };
    told.into_iter().map(place).collect()
}

fn axes(given: &Hypothesis, samples: &[Sample], since_reversal: &[f64]) -> Vec<Axis> {
    let (dataset, input) = (given.dataset, given.dataset.input);
    let has_current = input == Input::Voltage && matches!(given.model.kind, Kind::DcMotor { .. });
    let axis = |(variable, name)| Axis {
        name,
        unit: unit(variable, dataset.linear, input.unit()),
        values: match variable {
            Variable::TimeSinceReversal => since_reversal.to_vec(),
            _ => samples.iter().map(|s| s.of(variable).abs()).collect(),
        },
    };
    AXES.into_iter().filter(|it| it.0 != Variable::Current || has_current).map(axis).collect()
}

/// The stretch below or above a quantile that holds most more than its part of the squared torque.
fn densest(axis: &Axis, squares: &[f64]) -> Option<Region> {
    let mut order: Vec<usize> = (0..squares.len()).collect();
    order.sort_by(|a, b| axis.values[*a].total_cmp(&axis.values[*b]));
    let mut best: Option<(f64, f64, f64, bool)> = None;
    let mut below = 0.0;
    for (rank, index) in order.iter().enumerate() {
        below += squares[*index];
        let next = order.get(rank + 1).map(|k| axis.values[*k]);
        if next == Some(axis.values[*index]) || next.is_none() {
            continue;
        }
        let part = (rank + 1) as f64 / order.len() as f64;
        let edge = axis.values[*index];
        for (share, part, up_to) in [(below, part, true), (1.0 - below, 1.0 - part, false)] {
            let concentration = share - part;
            // A place of less than a fiftieth of the samples is an accident. Chosen by judgement; not studied.
            if part > 0.02 && best.is_none_or(|known| concentration > known.0) {
                best = Some((concentration, share, edge, up_to));
            }
        }
    }
    let (concentration, share, edge, up_to) = best?;
    let sign = if up_to { "<" } else { ">" };
    let text = format!("{} {sign} {} {}", axis.name, figure(edge), axis.unit);
    let inside = axis.values.iter().map(|value| (*value <= edge) == up_to);
    Some(Region { share, concentration, ..Region::new(text, inside, squares) })
}

fn direction(samples: &[Sample], squares: &[f64]) -> [Region; 3] {
    let region = |text: &str, inside: fn(&Sample) -> bool| {
        Region::new(text.to_owned(), samples.iter().map(inside), squares)
    };
    [
        region("speed > 0", |s| s.omega > 0.0),
        region("speed < 0", |s| s.omega < 0.0),
        region("bridge open", |s| s.open),
    ]
}
