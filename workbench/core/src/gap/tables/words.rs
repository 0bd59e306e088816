//! The figures that follow from the parameters of a name, and the regions of the voltage.

use super::study::Residual;
use crate::gap::order::by_least;
use crate::system::effects::Shape;
use crate::system::plant::physics::Physics;
use crate::text::figures::figure;

/// A figure that follows from the parameters: its key, unit, and how it is read from the plant.
pub type Derived = (&'static str, &'static str, fn(&Physics) -> f64);

/// The figures that follow from the parameters of an effect of this shape.
pub fn derived(shape: Shape) -> Vec<Derived> {
    match shape {
        Shape::Limit => vec![("knee_command_v", "V", knee), ("level_rad_s", "rad/s", level)],
        Shape::Edges => vec![("stops_above_v", "V", edge_pos), ("stops_below_v", "V", edge_neg)],
        Shape::ZeroCrossing => vec![("zero_speed_at_v", "V", zero_crossing)],
        Shape::Slope => vec![("slope_rad_s_per_v", "rad/s/V", slope)],
        Shape::Bend | Shape::Own => vec![],
    }
}

/// Command at which the limit of the drive begins.
pub fn knee(plant: &Physics) -> f64 {
    let line = unlimited(plant);
    let reached = level(plant);
    solve(|u| speed(&line, u) - reached, plant)
}

/// The speed at which a limit holds the reading, rad/s.
pub fn level(plant: &Physics) -> f64 {
    speed(plant, 1e3 * span(plant))
}

/// Smallest positive command that keeps the motor turning.
pub fn edge_pos(plant: &Physics) -> f64 {
    let shaft = shaft(plant);
    solve(|u| speed(&shaft, u), plant)
}

/// Largest negative command that keeps the motor turning.
pub fn edge_neg(plant: &Physics) -> f64 {
    let shaft = shaft(plant);
    -solve(|u| -speed(&shaft, -u), plant)
}

/// Command about which the curve is symmetric: where its straight parts of both directions, drawn on, meet zero on average.
pub fn zero_crossing(plant: &Physics) -> f64 {
    let line = unlimited(plant);
    let meets = |u: f64| {
        let (near, far) = (speed(&line, u), speed(&line, 1.01 * u));
        u - near / ((far - near) / (0.01 * u))
    };
    0.5 * (meets(0.5 * span(plant)) + meets(-0.5 * span(plant)))
}

/// The plant with a sensor that shows the shaft as it is.
fn shaft(plant: &Physics) -> Physics {
    Physics {
        sensor_offset: 0.0,
        sensor_scale: 1.0,
        sensor_rectified: false,
        sensor_limit: f64::INFINITY,
        ..plant.clone()
    }
}

/// Slope of the map beyond its dead zone and below its limit, rad/s/V.
pub fn slope(plant: &Physics) -> f64 {
    let line = unlimited(plant);
    let u = 0.5 * span(plant);
    (speed(&line, 1.01 * u) - speed(&line, u)) / (0.01 * u)
}

/// The plant without its limits.
fn unlimited(plant: &Physics) -> Physics {
    let free = f64::INFINITY;
    Physics { limit: free, sensor_limit: free, current_limit: free, ..plant.clone() }
}

/// A reading while the motor is already turning.
fn speed(plant: &Physics, u: f64) -> f64 {
    super::map::sweep(plant, &[3.0 * u, u])[1]
}

/// A voltage of the order of those in the table: what the limits and zones are worth in commands, else 1 V.
fn span(plant: &Physics) -> f64 {
    let behind = [plant.dead_pos, plant.dead_neg, plant.limit, 1.0];
    let largest = behind.iter().filter(|v| v.is_finite()).fold(0.0_f64, |m, v| m.max(v.abs()));
    10.0 * largest / plant.drive_gain
}

/// Where a rising function of the command becomes positive, by bisection.
fn solve(f: impl Fn(f64) -> f64, plant: &Physics) -> f64 {
    let (mut low, mut high) = (0.0, 100.0 * span(plant));
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle) > 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Regions of the voltage axis that the found edges and knees part, as (label, from, to) in |u|; thirds where there are none.
pub fn regions(marks: &[f64], largest: f64) -> Vec<(String, f64, f64)> {
    // Regions narrower than a twentieth hold too few rows to be worth a line of their own. Chosen by judgement; not studied.
    let mut edges: Vec<f64> =
        marks.iter().map(|m| m.abs()).filter(|m| *m > 0.02 * largest && *m < 0.98 * largest).collect();
    edges.sort_by(f64::total_cmp);
    edges.dedup_by(|a, b| (*a - *b).abs() < 0.05 * largest);
    if edges.is_empty() {
        edges = vec![largest / 3.0, 2.0 * largest / 3.0];
    }
    let inner =
        edges.windows(2).map(|w| (format!("{} V < |u| < {} V", figure(w[0]), figure(w[1])), w[0], w[1]));
    let first = (format!("|u| < {} V", figure(edges[0])), -1.0, edges[0]);
    let top = edges[edges.len() - 1];
    let last = (format!("|u| > {} V", figure(top)), top, f64::INFINITY);
    [first].into_iter().chain(inner).chain([last]).collect()
}

/// Shares of the squared error over regions of |u|, the largest first.
pub fn error_by_region(residual: &Residual, regions: &[(String, f64, f64)]) -> Vec<(String, f64)> {
    let total: f64 = residual.error.iter().map(|e| e * e).sum::<f64>().max(f64::MIN_POSITIVE);
    let inside = |from: f64, to: f64| {
        let rows = residual.volts.iter().zip(&residual.error);
        rows.filter(|(u, _)| u.abs() > from && u.abs() <= to).map(|(_, e)| e * e).sum::<f64>() / total
    };
    let mut all: Vec<_> = regions.iter().map(|(name, from, to)| (name.clone(), inside(*from, *to))).collect();
    by_least(&mut all, |it| -it.1);
    all
}
