//! The statistics of a fleet. Nothing here knows a motor.

pub mod change;
pub mod discoveries;
pub mod moved;
pub mod scatter;
pub mod spread;
pub mod step;

/// One measured number of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Days since the fleet's first log.
    pub day: f64,
    /// The number.
    pub value: f64,
    /// One standard deviation of it; > 0.
    pub sigma: f64,
}

impl Point {
    /// Its weight in a mean.
    pub fn weight(&self) -> f64 {
        self.sigma.powi(-2)
    }
}

/// Weighted mean of the values, and the sum of the weights.
pub fn mean(points: &[Point]) -> (f64, f64) {
    let total: f64 = points.iter().map(Point::weight).sum();
    (points.iter().map(|it| it.weight() * it.value).sum::<f64>() / total, total)
}
