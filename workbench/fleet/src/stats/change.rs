//! Does a number of a unit change over time? A line and a step are fitted to its logs.

use super::scatter::{Common, p_of_t};
use super::step::{self, Step};
use super::{Point, mean};

/// Fewer logs show neither a drift nor a step.
pub const FEWEST: usize = 6;

/// How a number changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Along a line.
    Drift,
    /// At once.
    Step,
}

/// A weighted line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Value at `day`.
    pub value: f64,
    /// The weighted mean of the days.
    pub day: f64,
    /// Change a day.
    pub slope: f64,
    /// Σw(day − mean)²: its inverse is the variance of the slope, in units of the scatter.
    pub information: f64,
    /// Σw(y − line)².
    pub left: f64,
}

impl Line {
    /// The best line through some points.
    pub fn of(points: &[Point]) -> Self {
        let (value, total) = mean(points);
        let day = points.iter().map(|it| it.weight() * it.day).sum::<f64>() / total;
        let sum = |of: &dyn Fn(&Point) -> f64| points.iter().map(|it| it.weight() * of(it)).sum::<f64>();
        let information = sum(&|it| (it.day - day).powi(2));
        let slope = sum(&|it| (it.day - day) * (it.value - value)) / information;
        let left = sum(&|it| (it.value - value - slope * (it.day - day)).powi(2));
        Self { value, day, slope, information, left }
    }

    /// Its value on a day.
    pub fn at(&self, day: f64) -> f64 {
        self.value + self.slope * (day - self.day)
    }
}

/// A series with what is fitted to it.
#[derive(Clone, Debug)]
pub struct Tested {
    /// The best line.
    pub line: Line,
    /// The best step.
    pub step: Step,
    /// p value of no slope.
    pub p_drift: f64,
    /// p value of no step anywhere.
    pub p_step: f64,
    /// One standard deviation of the slope, a day.
    pub slope_sigma: f64,
    /// One standard deviation of the step's size.
    pub step_sigma: f64,
    /// What its logs scatter by, over what they tell: a variance.
    pub scatter: f64,
    logs: usize,
}

/// Tests the series of one number of all units; `None` where a series is too short or does not move at all.
pub fn tested(series: &[Vec<Point>]) -> Vec<Option<Tested>> {
    let moves = |points: &&Vec<Point>| {
        points.len() >= FEWEST
            && points.iter().any(|it| it.value != points[0].value)
            && Line::of(points).left > 0.0
    };
    let usable = || series.iter().filter(moves);
    let of = |points: &Vec<Point>| {
        let freedom = points.len() as f64 - 2.0;
        (Line::of(points).left / freedom, freedom)
    };
    // Of lines, for the steps too: what the best of many steps leaves is less than the scatter.
    let common = Common::of(&usable().map(of).collect::<Vec<_>>());
    use rayon::prelude::*;
    let one = |points: &Vec<Point>| moves(&points).then(|| Tested::of(points, common));
    series.par_iter().map(one).collect()
}

impl Tested {
    fn of(points: &[Point], common: Common) -> Self {
        let (line, step, n) = (Line::of(points), Step::of(points), points.len() as f64);
        let (scatter, freedom) = common.moderated(line.left / (n - 2.0), n - 2.0);
        let slope_sigma = (scatter / line.information).sqrt();
        Self {
            p_drift: p_of_t(line.slope / slope_sigma, freedom),
            p_step: step::p_value(points, &step, common),
            slope_sigma,
            step_sigma: (common.moderated(step.left / (n - 2.0), n - 2.0).0 / step.information).sqrt(),
            scatter,
            line,
            step,
            logs: points.len(),
        }
    }

    /// p value of no change: the smaller of both, twice (Bonferroni).
    pub fn p(&self) -> f64 {
        (2.0 * self.p_drift.min(self.p_step)).min(1.0)
    }

    /// What describes the series better, of two that may both be significant: a drift looks like a step and a step like a drift. By
    /// Schwarz's criterion; a step has one number more, its day.
    pub fn better(&self) -> Kind {
        let n = self.logs as f64;
        match n * (self.line.left / self.step.left).ln() > n.ln() {
            true => Kind::Step,
            false => Kind::Drift,
        }
    }
}
