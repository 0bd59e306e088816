//! The numbers of a set's effects with their standard deviations, and whether they stand out from nothing.

use crate::gap::dataset::Dataset;
use crate::gap::fit::hypothesis::{Hypothesis, Item};
use crate::gap::fit::scored::{Scored, dispersion};
use crate::gap::fit::{FINAL, SEARCH, Setting, covariance};
use crate::gap::search::scatter;
use crate::gap::torque::Torque;
use crate::outcome::volts;
use crate::outcome::{DEVIATIONS, Value};
use crate::system::effects::{Meaning, Parameter, Starts};
use crate::system::model::Kind;
use crate::system::threads::*;
use nalgebra::{DMatrix, DVector};

/// The same for the squared distance of two or three numbers together. Origin: the 99.73 % quantile of χ² with three
/// degrees of freedom.
const TOGETHER: f64 = 14.16;
/// No number is surer than the voltage of the log, part of it: the supply is rounded by its converter. Origin: 12 bits up to 1.7 times
/// nominal, the step over √12.
const ROUNDED: f64 = 1.2e-4;
/// A set that leaves this much (χ² a sample) is wrong by several times the noise: its numbers are fitted anew with
/// its own error in the weights. Chosen by judgement; not studied.
const BEYOND_NOISE: f64 = 4.0;

/// One parameter of one effect of a set.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The parameter.
    pub parameter: &'static Parameter,
    /// Its value in its own unit.
    pub value: f64,
    /// One standard deviation, with what the log does not see of the motor; `None` for a number that was not fitted.
    pub std: Option<f64>,
    /// The same for a motor whose numbers are exact: whether there is anything of the effect.
    own: Option<f64>,
    /// The voltage and the acceleration that stand for a torque.
    pub seen: Vec<(String, Value)>,
}

/// The numbers of one effect of a set.
#[derive(Clone, Debug)]
pub struct Estimates {
    /// Its parameters. Optional ones that did not move are left out.
    pub numbers: Vec<Estimate>,
    /// The first side less the second, of an effect with two sides, and the voltage that stands for it: it may be sharp where the sides
    /// themselves can be traded for a number of the model.
    pub between_sides: Option<(Value, Option<Value>)>,
}

/// The numbers of each effect of a set, in its order.
pub fn estimates(kept: &Scored, uncertainty: &Uncertainty) -> Vec<Estimates> {
    let spread = Spread { kept, uncertainty };
    let items = each(&kept.hypothesis.items).enumerate();
    let of = |(index, item)| Estimates {
        numbers: spread.of_effect(index, item),
        between_sides: spread.between_sides(index, item),
    };
    items.map(of).collect()
}

/// What the numbers of a set are uncertain by.
#[derive(Clone, Debug)]
pub struct Uncertainty {
    /// Its diagonal is the variance of each number, in units of its scale, with what it scatters by between hollows of a rugged cost.
    covariance: DMatrix<f64>,
}

impl Uncertainty {
    /// Of a fitted set. With a rugged cost it takes a fit for each number.
    pub fn of(kept: &Scored) -> Self {
        let covariance = || {
            let factor = dispersion(kept);
            (factor, spread(kept, factor))
        };
        let ((factor, mut covariance), scatter) = join(covariance, || scatter(kept));
        for (slot, scatter) in scatter.iter().enumerate() {
            covariance[(slot, slot)] += scatter;
        }
        for (index, item) in kept.hypothesis.items.iter().enumerate() {
            let alone = kept.hypothesis.model.fitted_to_log && item.effect.parameters.len() == 1;
            if let Some(slot) = kept.hypothesis.slot(index, 0).filter(|_| alone) {
                let sharper = largest(kept, index, slot, factor) / covariance[(slot, slot)].sqrt();
                covariance.column_mut(slot).scale_mut(sharper.min(1.0));
                covariance.row_mut(slot).scale_mut(sharper.min(1.0));
            }
        }
        Self { covariance }
    }

    /// Standard deviations of all numbers of the set, effects and nuisances, each in units of its scale or its tolerance.
    pub fn deviations(&self) -> Vec<f64> {
        (0..self.covariance.nrows()).map(|k| self.covariance[(k, k)].max(0.0).sqrt()).collect()
    }
}

/// A set with what its numbers are uncertain by.
struct Spread<'s, 'a> {
    kept: &'s Scored<'a>,
    uncertainty: &'s Uncertainty,
}

impl Spread<'_, '_> {
    fn of_effect(&self, index: usize, item: &Item) -> Vec<Estimate> {
        let hypothesis = &self.kept.hypothesis;
        let first_order = matches!(hypothesis.model.kind, Kind::FirstOrder { .. });
        let estimate = |(k, parameter): (usize, &'static Parameter)| {
            let value = hypothesis.value(index, k, &self.kept.fit.x);
            let slot = hypothesis.slot(index, k);
            if slot.is_none() && parameter.default.is_some() {
                return None;
            }
            let (unit, covariance) =
                (hypothesis.unit(parameter.scale, &self.kept.fit.x), &self.uncertainty.covariance);
            let own = slot.map(|s| {
                let variance = covariance[(s, s)].max(0.0) * unit * unit;
                (variance + zero_variance(self.kept, index, parameter) + (ROUNDED * value).powi(2)).sqrt()
            });
            let torque = slot.filter(|_| parameter.unit.contains(volts::TORQUE));
            let torque = torque.map(|_| Torque { set: self.kept, covariance, place: (index, k), less: None });
            let std = torque.as_ref().map_or(own, Torque::std);
            let electrical = first_order && volts::ELECTRICAL.contains(&parameter.unit);
            let across =
                || (volts::key(parameter.name), Value { value, std, unit: volts::unit(parameter.unit) });
            let seen = torque.map(|torque| torque.seen(parameter.name, parameter.unit, true));
            let seen = seen.unwrap_or_else(|| electrical.then(across).into_iter().collect());
            Some(Estimate { parameter, value, std, own, seen })
        };
        item.effect.parameters.iter().enumerate().filter_map(estimate).collect()
    }

    /// The difference of the two sides of an effect, and the voltage that stands for it.
    fn between_sides(&self, index: usize, item: &Item) -> Option<(Value, Option<Value>)> {
        let (one, other) = item.effect.sides()?;
        let hypothesis = &self.kept.hypothesis;
        let (a, b) = (hypothesis.slot(index, one)?, hypothesis.slot(index, other)?);
        let parameter = &item.effect.parameters[one];
        let (x, covariance) = (&self.kept.fit.x, &self.uncertainty.covariance);
        let unit = hypothesis.unit(parameter.scale, x);
        let variance = covariance[(a, a)] + covariance[(b, b)] - 2.0 * covariance[(a, b)];
        let std = unit * variance.max(0.0).sqrt();
        let value = Value { value: unit * (x[a] - x[b]), std: Some(std), unit: parameter.unit.into() };
        let difference = Torque { set: self.kept, covariance, place: (index, one), less: Some(other) };
        let seen = || difference.seen(parameter.name, parameter.unit, false).pop();
        Some((value, parameter.unit.contains(volts::TORQUE).then(seen).flatten().map(|(_, volts)| volts)))
    }

    /// Whether the numbers that say how much of an effect there is lie clearly away from nothing, together: sizes from 0, ratios
    /// from 1. Of an effect without such a number (a limit, a period) any will do; one without numbers always stands out.
    fn stands_out(&self, index: usize, item: &Item) -> bool {
        let estimates = self.of_effect(index, item);
        let clear = |it: &Estimate| {
            it.own.is_some_and(|std| (it.value - it.parameter.nothing()).abs() > DEVIATIONS * std)
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
        let common = DMatrix::from_fn(n, n, |i, j| self.uncertainty.covariance[(slots[i], slots[j])]);
        let solved = common.cholesky().map(|factor| factor.solve(&away));
        solved.map_or(0.0, |solved| away.dot(&solved))
    }
}

/// Covariance of the numbers of a set whose residuals are so far from independent noise.
///
/// The information of the samples counts as many times less as their means scatter more than those of independent noise, the information
/// of the priors does not: C·(f·F + P)·C with C = (F + P)⁻¹ (the sandwich of Huber, Proc. Fifth Berkeley Symposium 1, 1967, with one factor
/// for all numbers).
fn spread(kept: &Scored, factor: f64) -> DMatrix<f64> {
    let plain = covariance(&kept.hypothesis, &kept.fit, &FINAL);
    let prior = |k: usize| if kept.hypothesis.slots[k].has_prior() { 1.0 } else { 0.0 };
    let priors = DMatrix::from_diagonal(&DVector::from_fn(plain.nrows(), |k, _| prior(k)));
    // f·F + P = f·(F + P) − (f − 1)·P, so that nothing has to be inverted again.
    &plain * factor - &plain * priors * &plain * (factor - 1.0)
}

/// The first effect of a set whose numbers all lie within three standard deviations of nothing. A base parameter has a measure of its
/// own: it is named beyond three tolerances.
pub fn indistinct(kept: &Scored, uncertainty: &Uncertainty) -> Option<usize> {
    let spread = Spread { kept, uncertainty };
    let items = kept.hypothesis.items.iter().enumerate();
    items
        .filter(|(index, item)| !item.effect.is_base_parameter() && !spread.stands_out(*index, item))
        .map(|(index, _)| index)
        .next()
}

/// A dataset whose weights hold the error of a set that leaves several times the noise. Those of a fitted model are one already.
pub fn eased(kept: &Scored) -> Option<Dataset> {
    let hypothesis = &kept.hypothesis;
    let coarse = !hypothesis.model.by_shares && kept.fit.chi2 > BEYOND_NOISE * kept.fit.samples as f64;
    let start = |run: usize| hypothesis.start_speed(run, &kept.fit.x);
    coarse.then(|| hypothesis.dataset.eased(&kept.plant(), start))
}

/// The same set, fitted with the weights of another dataset.
pub fn refitted<'a>(dataset: &'a Dataset, kept: &Scored<'a>) -> Scored<'a> {
    let hypothesis = Hypothesis::new(dataset, kept.hypothesis.model, kept.hypothesis.items.clone());
    let setting = Setting { iterations: SEARCH.iterations, ..FINAL };
    Scored::fitted(hypothesis, &kept.fit.x, &setting)
}

/// The largest standard deviation that the only size of an effect can have for a model that is a fit to the log: how much the
/// cost grows without the effect tells how far its value is from nothing (likelihood ratio; Wilks, Annals of Mathematical
/// Statistics 9, 1938). Where two lags can be traded for each other the covariance alone knows only the ridge between them.
fn largest(kept: &Scored, index: usize, slot: usize, factor: f64) -> f64 {
    let growth = (kept.only(|k| k != index, &SEARCH).fit.cost - kept.fit.cost) / factor;
    if growth > 1.0 { kept.fit.x[slot].abs() / growth.sqrt() } else { f64::INFINITY }
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
