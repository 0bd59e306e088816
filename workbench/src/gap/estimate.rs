//! The numbers of a set's effects with their standard deviations, and whether they stand out from nothing.

use crate::gap::dataset::Dataset;
use crate::gap::fit::{FINAL, SEARCH, Setting, covariance, fit};
use crate::gap::hypothesis::{Hypothesis, Item};
use crate::gap::search::{Scored, dispersion, scatter};
use crate::system::effects::{Meaning, Parameter, Starts};
use nalgebra::{DMatrix, DVector};

/// An effect is in the headline if one of its numbers lies further from nothing than this many standard deviations.
const DEVIATIONS: f64 = 2.0;
/// The same for the squared distance of two or three numbers together: the 95 % quantile of χ² with three degrees of freedom.
const TOGETHER: f64 = 7.81;
/// A set that leaves this much (χ² a sample) is wrong by several times the noise: its numbers are fitted anew with its own
/// error in the weights.
const BEYOND_NOISE: f64 = 4.0;

/// One parameter of one effect of a set.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The parameter.
    pub parameter: &'static Parameter,
    /// Its value in its own unit.
    pub value: f64,
    /// One standard deviation; `None` for a number that was not fitted.
    pub std: Option<f64>,
}

/// The numbers of each effect of a set, in its order. Optional parameters that did not move are left out.
pub fn estimates(kept: &Scored) -> Vec<Vec<Estimate>> {
    let spread = Spread::of(kept);
    let items = kept.hypothesis.items.iter().enumerate();
    items.map(|(index, item)| spread.of_effect(index, item)).collect()
}

/// What the numbers of a set are uncertain by.
struct Spread<'s, 'a> {
    kept: &'s Scored<'a>,
    covariance: DMatrix<f64>,
    /// Over-dispersion of what is left times its inflation by correlation.
    factor: f64,
    scatter: Vec<f64>,
}

impl<'s, 'a> Spread<'s, 'a> {
    fn of(kept: &'s Scored<'a>) -> Self {
        Self {
            kept,
            covariance: covariance(&kept.hypothesis, &kept.fit, &FINAL),
            factor: dispersion(kept),
            scatter: scatter(kept),
        }
    }

    fn of_effect(&self, index: usize, item: &Item) -> Vec<Estimate> {
        let hypothesis = &self.kept.hypothesis;
        let estimate = |(k, parameter): (usize, &'static Parameter)| {
            let value = hypothesis.value(index, k, &self.kept.fit.x);
            let slot = hypothesis.slot(index, k);
            if slot.is_none() && parameter.default.is_some() {
                return None;
            }
            let scale = hypothesis.dataset.scales.of(parameter.scale);
            let std = slot.map(|s| {
                let variance =
                    (self.covariance[(s, s)].max(0.0) * self.factor + self.scatter[s]) * scale * scale;
                let std = (variance + zero_variance(self.kept, index, parameter)).sqrt();
                std.min(largest(self.kept, index, item, value, self.factor))
            });
            Some(Estimate { parameter, value, std })
        };
        item.effect.parameters.iter().enumerate().filter_map(estimate).collect()
    }

    /// Whether the numbers that say how much of an effect there is lie clearly away from nothing, together: sizes from 0, ratios
    /// from 1. Of an effect without such a number (a limit, a period) any will do; one without numbers always stands out.
    fn stands_out(&self, index: usize, item: &Item) -> bool {
        let estimates = self.of_effect(index, item);
        let clear = |it: &Estimate| {
            it.std.is_some_and(|std| (it.value - it.parameter.nothing()).abs() > DEVIATIONS * std)
        };
        let measures: Vec<usize> =
            (0..item.effect.parameters.len()).filter(|k| item.effect.parameters[*k].measures()).collect();
        let known = |it: &&Estimate| it.parameter.measures();
        match measures.len() {
            0 => estimates.is_empty() || estimates.iter().any(clear),
            1 => estimates.iter().filter(known).any(clear),
            _ => estimates.iter().filter(known).any(clear) || self.distance(index, &measures) > TOGETHER,
        }
    }

    /// Squared distance of some parameters of an effect from nothing, in units of their common uncertainty (Wald, Transactions
    /// of the AMS 54, 1943): two slopes may be traded for each other while their difference is sharp.
    fn distance(&self, index: usize, parameters: &[usize]) -> f64 {
        let hypothesis = &self.kept.hypothesis;
        let slots: Option<Vec<usize>> = parameters.iter().map(|k| hypothesis.slot(index, *k)).collect();
        let Some(slots) = slots else { return 0.0 };
        let n = slots.len();
        let away = DVector::from_fn(n, |k, _| {
            let parameter = &hypothesis.items[index].effect.parameters[parameters[k]];
            let scale = hypothesis.dataset.scales.of(parameter.scale);
            self.kept.fit.x[slots[k]] - parameter.nothing() / scale
        });
        let common = DMatrix::from_fn(n, n, |i, j| {
            let own = if i == j { self.scatter[slots[i]] } else { 0.0 };
            self.covariance[(slots[i], slots[j])] * self.factor + own
        });
        let solved = common.cholesky().map(|factor| factor.solve(&away));
        solved.map_or(0.0, |solved| away.dot(&solved))
    }
}

/// The first effect of a set whose numbers all lie within two standard deviations of nothing. A base parameter has a measure of its
/// own: it is named beyond three tolerances.
pub fn indistinct(kept: &Scored) -> Option<usize> {
    let spread = Spread::of(kept);
    let items = kept.hypothesis.items.iter().enumerate();
    items
        .filter(|(index, item)| !item.effect.is_base_parameter() && !spread.stands_out(*index, item))
        .map(|(index, _)| index)
        .next()
}

/// A dataset whose weights hold the error of a set that leaves several times the noise.
pub fn eased(kept: &Scored) -> Option<Dataset> {
    let hypothesis = &kept.hypothesis;
    let coarse = kept.fit.chi2 > BEYOND_NOISE * kept.fit.samples as f64;
    let start = |run: usize| hypothesis.start_speed(run, &kept.fit.x);
    coarse.then(|| hypothesis.dataset.eased(&hypothesis.plant(&kept.fit.x), start))
}

/// The same set, fitted with the weights of another dataset.
pub fn refitted<'a>(dataset: &'a Dataset, kept: &Scored<'a>) -> Scored<'a> {
    let hypothesis = Hypothesis::new(dataset, kept.hypothesis.model, kept.hypothesis.items.clone());
    let setting = Setting { iterations: SEARCH.iterations, ..FINAL };
    let fit = fit(&hypothesis, &kept.fit.x, &setting);
    Scored { score: fit.cost, hypothesis, fit }
}

/// The largest standard deviation that the only size of an effect can have for a model that is a fit to the log: how much the
/// cost grows without the effect tells how far its value is from nothing (likelihood ratio; Wilks, Annals of Mathematical
/// Statistics 9, 1938). Where two lags can be traded for each other the covariance alone knows only the ridge between them.
fn largest(kept: &Scored, index: usize, item: &Item, value: f64, factor: f64) -> f64 {
    if !kept.hypothesis.model.fitted_to_log || item.effect.parameters.len() != 1 {
        return f64::INFINITY;
    }
    let (without, start) = kept.hypothesis.only(&kept.fit.x, |k| k != index);
    let growth = (fit(&without, &start, &SEARCH).cost - kept.fit.cost) / factor;
    if growth > 1.0 { value.abs() / growth.sqrt() } else { f64::INFINITY }
}

/// Variance of the phase of an effect of the position, because the encoder's zero lies anywhere within a count.
fn zero_variance(kept: &Scored, index: usize, parameter: &Parameter) -> f64 {
    let hypothesis = &kept.hypothesis;
    let effect = hypothesis.items[index].effect;
    let place = effect.place(Meaning::PeriodsPerTurn);
    let periods = match effect.starts {
        Starts::GravityScan => 1.0 / hypothesis.model.physics().gear_ratio,
        Starts::PositionScan => place.map_or(0.0, |k| hypothesis.value(index, k, &kept.fit.x)),
        _ => 0.0,
    };
    let encoder = hypothesis.model.encoder.filter(|_| parameter.meaning == Meaning::Phase);
    encoder.map_or(0.0, |encoder| (periods * std::f64::consts::TAU / encoder.counts_per_rev).powi(2) / 12.0)
}
