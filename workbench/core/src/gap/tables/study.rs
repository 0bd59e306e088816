//! The numbers behind a verdict: gap per step, noise floor, what is left, uncertainties.

use super::fit::Set;
use super::map;
use super::rows::Rows;
use super::sets::Search;
use super::speed_unit::SpeedUnit;
use crate::gap::acceptance::prediction::Prediction;
use crate::gap::fit::hypothesis::Item;
use crate::gap::order::by_least;
use crate::gap::residual::rms;
use crate::system::plant::physics::Physics;

/// Rows on which a gap is measured: voltages, readings, and which rows count.
pub struct HeldOut<'a> {
    /// One sweep per file.
    pub sweeps: Vec<(&'a [f64], &'a [f64], Vec<bool>)>,
}

impl HeldOut<'_> {
    /// The rows that count beside what a plant settles at, in the unit of the reader's table.
    pub fn predicted(&self, plant: &Physics, unit: SpeedUnit) -> Prediction {
        let mut prediction = Prediction::default();
        for (volts, omega, counts) in &self.sweeps {
            let pairs = omega.iter().zip(map::sweep(plant, volts));
            for ((measured, predicted), _) in pairs.zip(counts).filter(|(_, counts)| **counts) {
                prediction.measured.push(measured / unit.rad_s);
                prediction.predicted.push(predicted / unit.rad_s);
            }
        }
        prediction
    }
}

/// The accepted set as it grows, each with one effect more: at each step the one that lowers the mean square of the fitted
/// rows most. The last holds all effects, in the order of naming.
pub fn grow<'a>(search: &Search<'a>, accepted: &Set<'a>) -> Vec<Set<'a>> {
    let mut rest: Vec<Item> = accepted.hypothesis.items.clone();
    let mut sets: Vec<Set<'a>> = Vec::new();
    let mut parent = search.nothing();
    while let (Some(before), false) = (&parent, rest.is_empty()) {
        let tried = rest.iter().enumerate().filter_map(|(k, item)| Some((k, search.extended(before, item)?)));
        let Some((k, best)) = tried.min_by(|a, b| a.1.mean_square().total_cmp(&b.1.mean_square())) else {
            break;
        };
        rest.remove(k);
        sets.push(best.clone());
        parent = Some(best);
    }
    // The last set may sit in another minimum than the accepted one: the better of both stands.
    if let Some(last) = sets.last_mut().filter(|last| last.mean_square() > accepted.mean_square()) {
        *last = accepted.arranged(last.hypothesis.items.clone());
    }
    sets
}

/// Residuals of a table in the order of its voltages: what is noise, what is structure.
pub struct Residual {
    /// Voltages, ascending.
    pub volts: Vec<f64>,
    /// Reading minus prediction, rad/s.
    pub error: Vec<f64>,
}

impl Residual {
    /// Of a fitted set on every row.
    pub fn of(table: &Rows, plant: &Physics) -> Self {
        let mut rows: Vec<(f64, f64)> = table.volts.iter().copied().zip(table.residual(plant)).collect();
        by_least(&mut rows, |it| it.0);
        Residual { volts: rows.iter().map(|r| r.0).collect(), error: rows.iter().map(|r| r.1).collect() }
    }

    /// Rms that neighbours do not share: half the mean squared difference (von Neumann, Ann. Math. Statist. 12, 1941).
    pub fn noise(&self) -> f64 {
        rms(&self.error.windows(2).map(|w| (w[1] - w[0]) / 2f64.sqrt()).collect::<Vec<f64>>())
    }

    /// Rms of all.
    pub fn rms(&self) -> f64 {
        rms(&self.error)
    }

    /// Correlation of neighbours in standard deviations of what independent residuals show.
    pub fn likeness(&self) -> f64 {
        let power: f64 = self.error.iter().map(|e| e * e).sum();
        let pairs: f64 = self.error.windows(2).map(|w| w[0] * w[1]).sum();
        pairs / power.max(f64::MIN_POSITIVE) * (self.error.len() as f64).sqrt()
    }
}
