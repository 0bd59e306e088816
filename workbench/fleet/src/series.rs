//! The numbers of a fleet: each over units and days, out of the results.

use crate::moment::Moment;
use crate::stats::Point;
use crate::store::{Kept, Number, Told};
use std::collections::BTreeMap;

/// One number of one log.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Day, value and sigma.
    pub point: Point,
    /// When.
    pub at: Moment,
    /// SHA-256 of the log.
    pub log: String,
}

/// One number of one unit in the order of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The unit.
    pub unit: String,
    /// A reading a log.
    pub readings: Vec<Reading>,
}

impl Series {
    /// Days, values and sigmas.
    pub fn points(&self) -> Vec<Point> {
        self.readings.iter().map(|reading| reading.point).collect()
    }
}

/// One number of the fleet.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// `coulomb_friction.level_nm`, or `R_ohm` for a number of the model file.
    pub name: String,
    /// Its unit; `%` for a number of the model file, which is told against what the file says.
    pub unit: String,
    /// The units that have it.
    pub series: Vec<Series>,
}

/// All numbers that have a standard deviation. The first log of the fleet is day 0.
pub fn quantities(fleet: &[(String, Vec<Kept>)]) -> Vec<Quantity> {
    let Some(first) = fleet.iter().flat_map(|(_, results)| results).map(|kept| kept.key.at).min() else {
        return Vec::new();
    };
    let mut quantities = BTreeMap::<(String, String), Vec<Series>>::new();
    for (unit, results) in fleet {
        for kept in results.iter().filter(|kept| kept.outcome.judged()) {
            for (name, [value, sigma], of) in numbers(&kept.outcome) {
                let series = quantities.entry((name, of)).or_default();
                if series.last().is_none_or(|last| last.unit != *unit) {
                    series.push(Series { unit: unit.clone(), readings: Vec::new() });
                }
                let point = Point { day: kept.key.at.days_since(first), value, sigma };
                let reading = Reading { point, at: kept.key.at, log: kept.key.log.clone() };
                series.last_mut().expect("one was pushed").readings.push(reading);
            }
        }
    }
    let quantity = |((name, unit), series)| Quantity { name, unit, series };
    quantities.into_iter().map(quantity).collect()
}

/// Name, value with sigma, and unit of each number of a log.
pub(crate) fn numbers(told: &Told) -> impl Iterator<Item = (String, [f64; 2], String)> {
    let of_effects = told.effects.iter().flat_map(|effect| {
        let named = |(key, number): (&String, &Number)| {
            Some((format!("{}.{key}", effect.name), [number.value?, number.std?], number.unit.clone()))
        };
        effect.parameters.iter().filter_map(named).collect::<Vec<_>>()
    });
    let of_model = told.within_tolerance.iter().filter_map(|shifted| {
        Some((shifted.parameter.clone(), [shifted.shift_percent?, shifted.std_percent?], "%".to_owned()))
    });
    of_effects.chain(of_model).filter(|(_, [_, sigma], _)| *sigma > 0.0)
}
