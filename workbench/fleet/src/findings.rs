//! What a fleet's results come to: `truing-fleet-report/1`.

use crate::appeared::{self, Appeared};
use crate::moment::Moment;
use crate::series::{Quantity, Series, quantities};
use crate::stats::change::{self, Kind, Tested};
use crate::stats::discoveries::q_values;
use crate::stats::scatter::Common;
use crate::stats::spread::{Method, Spread, Unit, spread};
use crate::stats::{Point, mean};
use crate::store::Kept;
use serde::Serialize;

/// Alarms of which a share is expected to be false, unless the user says otherwise.
pub const RATE: f64 = 0.05;

/// The spread of one number between units.
#[derive(Clone, Debug, Serialize)]
pub struct SpreadOf {
    /// The number.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// Mean and standard deviation of the units.
    #[serde(flatten)]
    pub spread: Spread,
    /// Logs.
    pub logs: usize,
    /// Scatter between logs of a unit over what the logs tell.
    pub scatter: f64,
}

/// A number of a unit that changes.
#[derive(Clone, Debug, Serialize)]
pub struct Changed {
    /// The unit.
    pub unit: String,
    /// The number.
    pub quantity: String,
    /// Its unit.
    pub of: String,
    /// How.
    pub kind: Kind,
    /// When it begins: the first log of a drift, the first one after a step.
    pub at: Moment,
    /// From the first log to the last one, or over the step.
    pub change: f64,
    /// One standard deviation of that.
    pub sigma: f64,
    /// p value of no change.
    pub p: f64,
    /// The share of false ones expected among alarms up to this one.
    pub q: f64,
    /// SHA-256 of the logs behind it, in the order of time.
    pub logs: Vec<String>,
}

/// What a fleet's results come to.
#[derive(Clone, Debug, Serialize)]
pub struct Findings {
    /// `truing-fleet-report/1`.
    pub schema: &'static str,
    /// Units.
    pub units: usize,
    /// Results.
    pub logs: usize,
    /// Results of logs that could not be judged: they do not move, or the file is at fault.
    pub not_judged: usize,
    /// The expected share of false alarms among `changed`.
    pub rate: f64,
    /// Tests among which that holds.
    pub tests: usize,
    /// Drifts and steps, the surest first.
    pub changed: Vec<Changed>,
    /// New effects, in the order of units and time.
    pub appeared: Vec<Appeared>,
    /// Numbers over units.
    pub spread: Vec<SpreadOf>,
}

/// A test of one series.
struct Test<'a> {
    quantity: &'a Quantity,
    series: &'a Series,
    tested: Tested,
}

impl Findings {
    /// Of the results of each unit. `rate`: the share of false ones that is allowed among drifts and steps.
    pub fn of(fleet: &[(String, Vec<Kept>)], method: Method, rate: f64) -> Self {
        let quantities = quantities(fleet);
        let tests: Vec<Test> = quantities.iter().flat_map(tests).collect();
        let results = || fleet.iter().flat_map(|(_, results)| results);
        Self {
            schema: "truing-fleet-report/1",
            units: fleet.len(),
            logs: results().count(),
            not_judged: results().filter(|kept| !kept.outcome.judged()).count(),
            rate,
            tests: tests.len(),
            changed: changed(&tests, rate),
            appeared: fleet.iter().flat_map(|(unit, results)| appeared::of_unit(unit, results)).collect(),
            spread: quantities.iter().filter_map(|quantity| spread_of(quantity, method)).collect(),
        }
    }
}

fn tests(quantity: &Quantity) -> Vec<Test<'_>> {
    let points: Vec<Vec<Point>> = quantity.series.iter().map(Series::points).collect();
    let tested = change::tested(&points).into_iter().zip(&quantity.series);
    tested.filter_map(|(tested, series)| Some(Test { quantity, series, tested: tested? })).collect()
}

/// The alarms. A series is one test, of no change at all: counted as two, a true change would bring two alarms, and leave room for twice the
/// false ones. It is told as what describes it better.
fn changed(tests: &[Test], rate: f64) -> Vec<Changed> {
    let p: Vec<f64> = tests.iter().map(|test| test.tested.p()).collect();
    let alarms = tests.iter().zip(q_values(&p)).filter(|(_, q)| *q <= rate);
    let mut changed: Vec<Changed> = alarms.map(|(test, q)| test.told(test.tested.better(), q)).collect();
    changed.sort_by(|a, b| a.p.total_cmp(&b.p));
    changed
}

impl Test<'_> {
    fn told(&self, kind: Kind, q: f64) -> Changed {
        let (tested, readings) = (&self.tested, &self.series.readings);
        let days = readings[readings.len() - 1].point.day - readings[0].point.day;
        let (first, change, sigma) = match kind {
            Kind::Drift => (0, tested.line.slope * days, tested.slope_sigma * days),
            Kind::Step => {
                let [before, after] = tested.step.levels;
                (tested.step.first, after - before, tested.step_sigma)
            }
        };
        Changed {
            unit: self.series.unit.clone(),
            quantity: self.quantity.name.clone(),
            of: self.quantity.unit.clone(),
            kind,
            at: readings[first].at,
            change,
            sigma,
            p: tested.p(),
            q,
            logs: readings.iter().map(|reading| reading.log.clone()).collect(),
        }
    }
}

/// A unit's number is the weighted mean of its logs, its variance that of the mean times what the logs scatter beyond their sigmas.
fn spread_of(quantity: &Quantity, method: Method) -> Option<SpreadOf> {
    let points: Vec<Vec<Point>> = quantity.series.iter().map(Series::points).collect();
    let variance = |points: &Vec<Point>| {
        let (middle, freedom) = (mean(points).0, points.len() as f64 - 1.0);
        let squares: f64 = points.iter().map(|it| it.weight() * (it.value - middle).powi(2)).sum();
        (if freedom > 0.0 { squares / freedom } else { 0.0 }, freedom)
    };
    let variances: Vec<(f64, f64)> = points.iter().map(variance).collect();
    let common = Common::of(&variances);
    let unit = |(points, (scatter, freedom)): (&Vec<Point>, &(f64, f64))| -> Unit {
        let (middle, total) = mean(points);
        let scatter =
            if common.freedom + freedom > 0.0 { common.moderated(*scatter, *freedom).0 } else { 1.0 };
        (middle, scatter / total)
    };
    let units: Vec<Unit> = points.iter().zip(&variances).map(unit).collect();
    let (name, of) = (quantity.name.clone(), quantity.unit.clone());
    let logs = points.iter().map(Vec::len).sum();
    let spread = spread(&units, method)?;
    Some(SpreadOf { quantity: name, unit: of, spread, logs, scatter: common.variance.sqrt() })
}
