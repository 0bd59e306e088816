//! The numbers behind a verdict: gap per step, noise floor, what is left, uncertainties.

use super::fit::{Data, Fit, Problem};
use super::map;
use super::search::Search;
use crate::system::effects::Effect;
use crate::system::plant::physics::Physics;
use nalgebra::DMatrix;

/// Rows on which a gap is measured: voltages, readings, and which rows count.
pub struct HeldOut<'a> {
    /// One sweep per file.
    pub sweeps: Vec<(&'a [f64], &'a [f64], Vec<bool>)>,
}

impl HeldOut<'_> {
    /// Readings and predictions of the rows that count.
    pub fn pairs(&self, plant: &Physics) -> Vec<(f64, f64)> {
        let of = |(volts, omega, counts): &(&[f64], &[f64], Vec<bool>)| {
            let predicted = map::sweep(plant, volts);
            let rows = omega.iter().copied().zip(predicted).zip(counts.iter().copied());
            rows.filter(|(_, c)| *c).map(|(pair, _)| pair).collect::<Vec<_>>()
        };
        self.sweeps.iter().flat_map(of).collect()
    }

    /// Root mean square of the residual, rad/s.
    pub fn rms(&self, plant: &Physics) -> f64 {
        rms(self.pairs(plant).into_iter().map(|(y, p)| y - p))
    }

    /// 100·(1 − ‖y−ŷ‖/‖y−ȳ‖).
    pub fn fit_percent(&self, plant: &Physics) -> f64 {
        let pairs = self.pairs(plant);
        let mean = pairs.iter().map(|p| p.0).sum::<f64>() / pairs.len().max(1) as f64;
        let spread = rms(pairs.iter().map(|p| p.0 - mean)).max(f64::MIN_POSITIVE);
        100.0 * (1.0 - self.rms(plant) / spread)
    }
}

/// Root mean square; 0 for nothing.
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0_usize), |(s, n), v| (s + v * v, n + 1));
    (sum / n.max(1) as f64).sqrt()
}

/// The accepted set and its growth, effect by effect.
pub struct Growth {
    /// The sets, each with one effect more; the last is the accepted set, its effects in the order of naming.
    pub sets: Vec<Fit>,
}

/// Orders the effects of a set: at each step the one that lowers the mean square of the fitted rows most.
pub fn grow(search: &Search, accepted: &Fit) -> Growth {
    let mut rest: Vec<_> = accepted.forms.clone();
    let mut sets: Vec<Fit> = Vec::new();
    let mut parent = search.nothing();
    while let (Some(before), false) = (&parent, rest.is_empty()) {
        let tried = rest
            .iter()
            .enumerate()
            .filter_map(|(k, form)| Some((k, search.extended(before, form)?)));
        let Some((k, best)) = tried.min_by(|a, b| a.1.mean_square.total_cmp(&b.1.mean_square)) else {
            break;
        };
        rest.remove(k);
        sets.push(best.clone());
        parent = Some(best);
    }
    settle_last(&mut sets, accepted);
    Growth { sets }
}

/// The last set grown step by step may sit in another minimum than the accepted one: the better of both stands.
fn settle_last(sets: &mut [Fit], accepted: &Fit) {
    let Some(last) = sets.last_mut() else { return };
    if last.mean_square <= accepted.mean_square {
        return;
    }
    let place = |effect: &Effect| accepted.forms.iter().position(|f| f.effect == effect);
    let order: Vec<usize> = last.forms.iter().filter_map(|f| place(f.effect)).collect();
    let start = |k: usize| accepted.forms[..k].iter().map(|f| f.size()).sum::<usize>();
    let own = order
        .iter()
        .flat_map(|&k| accepted.x[start(k)..start(k) + accepted.forms[k].size()].to_vec());
    let x = own.chain(accepted.shifts().iter().copied()).collect();
    let forms = order.iter().map(|&k| accepted.forms[k].clone()).collect();
    *last = Fit {
        forms,
        x,
        ..accepted.clone()
    };
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
    pub fn of(data: &Data, plant: &Physics) -> Self {
        let predicted = map::sweep(plant, &data.volts);
        let mut rows: Vec<(f64, f64)> = data
            .volts
            .iter()
            .zip(data.omega.iter().zip(&predicted))
            .map(|(u, (y, p))| (*u, y - p))
            .collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        Residual {
            volts: rows.iter().map(|r| r.0).collect(),
            error: rows.iter().map(|r| r.1).collect(),
        }
    }

    /// Rms that neighbours do not share: half the mean squared difference (von Neumann, Ann. Math. Statist. 12, 1941).
    pub fn noise(&self) -> f64 {
        rms(self.error.windows(2).map(|w| (w[1] - w[0]) / 2f64.sqrt()))
    }

    /// Rms of all.
    pub fn rms(&self) -> f64 {
        rms(self.error.iter().copied())
    }

    /// Correlation of neighbours in standard deviations of what independent residuals show.
    pub fn likeness(&self) -> f64 {
        let power: f64 = self.error.iter().map(|e| e * e).sum();
        let pairs: f64 = self.error.windows(2).map(|w| w[0] * w[1]).sum();
        pairs / power.max(f64::MIN_POSITIVE) * (self.error.len() as f64).sqrt()
    }
}

/// Standard deviation of a figure that follows from the fitted parameters: √(g Σ gᵀ), g by differences.
pub fn deviation(
    problem: &Problem,
    fit: &Fit,
    covariance: &DMatrix<f64>,
    figure: impl Fn(&Physics) -> f64,
) -> Option<f64> {
    let at = figure(&problem.plant(&fit.forms, &fit.x));
    let gradient: Vec<f64> = (0..fit.x.len())
        .map(|j| {
            let width = 1e-3 * covariance[(j, j)].sqrt().max(1e-12);
            let mut moved = fit.x.clone();
            moved[j] += width;
            (figure(&problem.plant(&fit.forms, &moved)) - at) / width
        })
        .collect();
    let gradient = nalgebra::DVector::from_vec(gradient);
    let variance = (gradient.transpose() * covariance * &gradient)[(0, 0)];
    (variance.is_finite() && variance >= 0.0).then(|| variance.sqrt())
}
