//! Where simulation and data disagree: the regions of input, speed, direction, acceleration, current, time since
//! reversal and time in which the missing torque is concentrated.
//!
//! The missing torque J·ė + D·e of a linear base is exact (superposition), and unlike the residual it is not smeared
//! over a time constant. A region is worth telling when it holds much more of the squared torque than of the samples.

use crate::gap::hypothesis::Hypothesis;
use crate::gap::samples::Sample;
use crate::outcome::Where;
use crate::system::model::Kind;

/// Regions that are told.
const TOLD: usize = 3;
/// A region must hold this much more of the error than of the samples.
const CONCENTRATED: f64 = 0.15;

/// A quantity over which the missing torque is looked at.
struct Axis {
    name: &'static str,
    unit: &'static str,
    values: Vec<f64>,
}

/// Two regions are one if so much of the squared error that lies in either lies in both: a step, the first moments after it and a large
/// acceleration are the same rows.
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
    regions.sort_by(|a, b| b.concentration.total_cmp(&a.concentration));
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
    let (speed, acceleration) = if given.dataset.linear { ("m/s", "m/s²") } else { ("rad/s", "rad/s²") };
    let over = |name, unit, value: &dyn Fn(&Sample) -> f64| Axis {
        name,
        unit,
        values: samples.iter().map(value).collect(),
    };
    let mut axes = vec![
        over("|u|", given.dataset.input.unit(), &|s| s.input.abs()),
        over("|speed|", speed, &|s| s.omega.abs()),
        over("|acceleration|", acceleration, &|s| s.acceleration.abs()),
        Axis { name: "time since reversal", unit: "s", values: since_reversal.to_vec() },
        over("time", "s", &|s| s.time),
    ];
    if given.dataset.input == crate::system::log::Input::Voltage
        && matches!(given.model.kind, Kind::DcMotor { .. })
    {
        axes.push(over("|current|", "A", &|s| s.current.abs()));
    }
    axes
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
            if part > 0.02 && best.is_none_or(|known| concentration > known.0) {
                best = Some((concentration, share, edge, up_to));
            }
        }
    }
    let (concentration, share, edge, up_to) = best?;
    let sign = if up_to { "<" } else { ">" };
    Some(Region {
        text: format!("{} {sign} {} {}", axis.name, crate::text::figures::figure(edge), axis.unit),
        share,
        concentration,
        inside: axis.values.iter().map(|value| (*value <= edge) == up_to).collect(),
        also: Vec::new(),
    })
}

fn direction(samples: &[Sample], squares: &[f64]) -> Vec<Region> {
    let region = |text: &str, inside: &dyn Fn(&Sample) -> bool| {
        let inside: Vec<bool> = samples.iter().map(inside).collect();
        let share: f64 = inside.iter().zip(squares).filter(|(inside, _)| **inside).map(|(_, q)| q).sum();
        let part = inside.iter().filter(|inside| **inside).count() as f64 / samples.len() as f64;
        Region { text: text.into(), share, concentration: share - part, inside, also: Vec::new() }
    };
    vec![
        region("speed > 0", &|s| s.omega > 0.0),
        region("speed < 0", &|s| s.omega < 0.0),
        region("bridge open", &|s| s.open),
    ]
}
