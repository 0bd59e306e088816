//! The one regression on what is left: how much of it a table over some variables predicts on data to which it was not fitted.

use super::candidates::Candidate;
use super::track::{Compared, Tracks};
use crate::gap::dataset::Part;
use crate::gap::fit::hypothesis::Hypothesis;
use crate::gap::fit::problem::dot;
use crate::gap::fit::scored::Scored;
use crate::system::plant::physics::Physics;
use crate::system::plant::unnamed::{Term, Variable};
use crate::system::threads::*;
use nalgebra::{DMatrix, DVector};

/// How much a bend of the table costs beside the data, in units of the mean information of a value: the one that
/// predicts the other fold best is taken. Chosen by judgement, two decades apart.
const STIFFNESSES: [f64; 3] = [1e-4, 1e-2, 1.0];
/// The same for the size of a value: keeps what no sample reaches at 0. Chosen by judgement; not studied.
const RIDGE: f64 = 1e-6;
/// The numbers of the model are fitted together with the table; they are known to one standard deviation of their
/// priors. Origin: definition.
const PRIOR: f64 = 1.0;

/// A dependence with its table and what it predicts.
#[derive(Clone, Debug)]
pub struct Dependence {
    /// What is tried, with the values of its table.
    pub candidate: Candidate,
    /// Share of the other fold's remainder that a table fitted to one fold predicts.
    pub crossed: f64,
    /// Share of the held-out remainder that the table predicts, in the record for which it is smallest.
    pub held_out: f64,
    /// Stiffness that was taken, in absolute units.
    pub stiffness: f64,
}

impl Dependence {
    /// By what dependences are compared.
    pub fn score(&self) -> f64 {
        self.crossed.min(self.held_out)
    }
}

/// The remainder of a fit, ready for the regressions.
pub struct Regression<'s, 'a> {
    scored: &'s Scored<'a>,
    tracks: &'s Tracks,
    compared: &'s [Compared],
    residual: DVector<f64>,
    /// What the numbers of the model do to each sample.
    nuisances: DMatrix<f64>,
    /// How far each of them may shift, down and up.
    bounds: Vec<(f64, f64)>,
    /// Standard deviation of the noise that no table predicts.
    sigma: f64,
}

/// Sums of a regression over some samples.
#[derive(Clone)]
pub struct Sums {
    /// Products of its columns.
    pub information: DMatrix<f64>,
    /// Products of the columns with what is left.
    pub projected: DVector<f64>,
}

impl Sums {
    /// Over all rows of the columns.
    pub fn of(columns: &DMatrix<f64>, residual: &DVector<f64>) -> Self {
        let column = |k: usize| columns.column(k);
        let product = |i, j| if i < j { 0.0 } else { dot(column(i).as_slice(), column(j).as_slice()) };
        let mut information = DMatrix::from_fn(columns.ncols(), columns.ncols(), product);
        information.fill_upper_triangle_with_lower_triangle();
        Self { information, projected: columns.tr_mul(residual) }
    }
}

impl<'s, 'a> Regression<'s, 'a> {
    /// Of a fitted set.
    pub fn new(scored: &'s Scored<'a>, tracks: &'s Tracks, compared: &'s [Compared], sigma: f64) -> Self {
        let residual = DVector::from_iterator(compared.len(), compared.iter().map(|it| it.residual));
        let bound = |(slot, x): (usize, &f64)| {
            let (lower, upper) = scored.hypothesis.bounds(slot);
            (lower - x, upper - x)
        };
        let bounds = scored.fit.x.iter().enumerate().map(bound).collect();
        Self { scored, tracks, compared, residual, nuisances: nuisances(scored, compared), bounds, sigma }
    }

    /// Tries one dependence.
    pub fn tried(&self, candidate: &Candidate) -> Option<Dependence> {
        let size = candidate.term.values.len();
        let responses = self.tracks.responses(&self.scored.hypothesis, &candidate.term, self.compared.len());
        let columns = joined(&responses, &self.nuisances);
        let folds = self.folds(candidate);
        let sums = folds.map(|fold| self.sums(&columns, fold));
        let information = (0..size).map(|k| sums[0].information[(k, k)] + sums[1].information[(k, k)]);
        let unit = information.sum::<f64>() / size as f64;
        let trial = |stiffness: f64| -> Option<(f64, f64)> {
            let fitted = |sums: &Sums| self.bounded(sums, &candidate.term, 0.5 * unit, stiffness);
            let (first, second) = (fitted(&sums[0])?, fitted(&sums[1])?);
            let (a, b) = (self.left(&columns, &second, folds[0]), self.left(&columns, &first, folds[1]));
            Some((share(&[a, b]), stiffness))
        };
        let tried = STIFFNESSES.iter().filter_map(|stiffness| trial(*stiffness));
        let (crossed, stiffness) = tried.max_by(|a, b| a.0.total_cmp(&b.0))?;
        // Both folds together, where the second one is no other record, are the log.
        let mut log = sums[0].clone();
        if self.compared.iter().any(|it| in_log(it) && folds[1](it)) {
            log.information += &sums[1].information;
            log.projected += &sums[1].projected;
        }
        let values = self.bounded(&log, &candidate.term, unit, stiffness)?;
        let mut candidate = candidate.clone();
        candidate.term.values = values.iter().take(size).copied().collect();
        Some(Dependence {
            candidate,
            crossed,
            held_out: self.held_out(&columns, &values),
            stiffness: stiffness * unit,
        })
    }

    /// The two folds of the log; where another run must be judged, every second run is one.
    fn folds(&self, candidate: &Candidate) -> [fn(&Compared) -> bool; 2] {
        let several = self.compared.iter().any(|it| it.log == 0 && it.run > 0);
        // What happens at a time happens in one run.
        match (candidate.term.over.iter().any(|knots| knots.variable == Variable::Time), several) {
            (false, _) => [|it| it.part == Part::A, |it| it.part == Part::B],
            (true, true) => [|it| in_log(it) && it.run % 2 == 0, |it| in_log(it) && it.run % 2 == 1],
            // The held-out records are the other runs: each half of the samples is judged by the other record.
            (true, false) => [in_log, |it| it.part == Part::HoldOut && it.log > 0],
        }
    }

    /// Values of a table and shifts of the model's numbers; a number that would leave its bounds stays at the bound.
    fn bounded(&self, sums: &Sums, term: &Term, unit: f64, stiffness: f64) -> Option<DVector<f64>> {
        let size = term.values.len();
        let mut held = vec![None; size + self.bounds.len()];
        loop {
            let x = solved(sums, term, unit, stiffness, &held)?;
            let beyond = |k: usize| {
                let (lower, upper) = self.bounds[k];
                let value = x[size + k];
                (value < lower || value > upper).then(|| value.clamp(lower, upper))
            };
            let new: Vec<(usize, f64)> = (0..self.bounds.len())
                .filter(|k| held[size + k].is_none())
                .filter_map(|k| Some((size + k, beyond(k)?)))
                .collect();
            if new.is_empty() {
                return Some(x);
            }
            new.into_iter().for_each(|(k, value)| held[k] = Some(value));
        }
    }

    fn sums(&self, columns: &DMatrix<f64>, counts: impl Fn(&Compared) -> bool) -> Sums {
        let rows: Vec<usize> = (0..self.compared.len()).filter(|k| counts(&self.compared[*k])).collect();
        Sums::of(&columns.select_rows(&rows), &self.residual.select_rows(&rows))
    }

    /// Squares before and after a table, beyond the noise.
    fn left(&self, table: &DMatrix<f64>, x: &DVector<f64>, counts: impl Fn(&Compared) -> bool) -> (f64, f64) {
        let (mut left, told) = ((0.0, 0.0), table * x);
        for (k, it) in self.compared.iter().enumerate().filter(|(_, it)| counts(it)) {
            let noise = (self.sigma * it.weight).powi(2).min(1.0);
            let after = it.residual - told[k];
            left.0 += it.residual.powi(2) - noise;
            left.1 += after.powi(2) - noise;
        }
        left
    }

    /// The smallest share of a held-out record that is predicted.
    fn held_out(&self, columns: &DMatrix<f64>, x: &DVector<f64>) -> f64 {
        let mut logs: Vec<usize> =
            self.compared.iter().filter(|it| it.part == Part::HoldOut).map(|it| it.log).collect();
        logs.dedup();
        let of = |log: usize| share(&[self.left(columns, x, |it| it.part == Part::HoldOut && it.log == log)]);
        logs.into_iter().map(of).fold(1.0, f64::min)
    }
}

fn in_log(it: &Compared) -> bool {
    matches!(it.part, Part::A | Part::B)
}

/// The part of the squares that is gone, 0 … 1.
fn share(left: &[(f64, f64)]) -> f64 {
    let (before, after) = left.iter().fold((0.0, 0.0), |sum, it| (sum.0 + it.0, sum.1 + it.1));
    if before <= 0.0 { 0.0 } else { (1.0 - after / before).clamp(-1.0, 1.0) }
}

fn joined(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let mut all = left.clone().resize_horizontally(left.ncols() + right.ncols(), 0.0);
    all.columns_mut(left.ncols(), right.ncols()).copy_from(right);
    all
}

/// What a plant predicts of every compared sample.
pub fn predicted(hypothesis: &Hypothesis, x: &[f64], plant: &Physics) -> Vec<f64> {
    let mut values = Vec::new();
    hypothesis.simulated(x, plant, |_, _, predicted| values.extend_from_slice(predicted));
    values
}

/// What the numbers of the model do to each compared sample, in its standard deviations.
fn nuisances(scored: &Scored, compared: &[Compared]) -> DMatrix<f64> {
    let hypothesis = &scored.hypothesis;
    let at = |x: &[f64]| predicted(hypothesis, x, &hypothesis.plant(x));
    let here = at(&scored.fit.x);
    let column = |slot: usize| {
        let mut x = scored.fit.x.clone();
        let step = hypothesis.step(slot);
        let step = if x[slot] + step > hypothesis.bounds(slot).1 { -step } else { step };
        x[slot] += step;
        let moved = at(&x).into_iter().zip(&here).zip(compared);
        moved.map(|((moved, here), it)| (moved - here) / step * it.weight).collect::<Vec<f64>>()
    };
    let columns = each(0..hypothesis.slots.len()).flat_map_iter(column);
    DMatrix::from_vec(compared.len(), hypothesis.slots.len(), columns.collect())
}

/// The same where some numbers are held.
fn solved(sums: &Sums, term: &Term, unit: f64, stiffness: f64, held: &[Option<f64>]) -> Option<DVector<f64>> {
    let (mut matrix, size) = (sums.information.clone(), term.values.len());
    let mut right = sums.projected.clone();
    for bend in bends(term) {
        for (i, a) in bend {
            for (j, b) in bend {
                matrix[(i, j)] += stiffness * unit * a * b;
            }
        }
    }
    for k in 0..matrix.nrows() {
        matrix[(k, k)] += if k < size { RIDGE * unit } else { PRIOR };
    }
    for (k, value) in held.iter().enumerate().filter_map(|(k, value)| Some((k, (*value)?))) {
        right -= matrix.column(k) * value;
        matrix.row_mut(k).fill(0.0);
        matrix.column_mut(k).fill(0.0);
        matrix[(k, k)] = 1.0;
        right[k] = value;
    }
    matrix.cholesky().map(|factor| factor.solve(&right))
}

/// Second differences of a table along each of its variables: three places with their factors.
pub fn bends(term: &Term) -> Vec<[(usize, f64); 3]> {
    let inner = term.over.get(1).map_or(1, |knots| knots.at.len());
    let outer = term.over[0].at.len();
    let mut all = Vec::new();
    let mut along = |place: &dyn Fn(usize) -> usize, count: usize, periodic: bool| {
        let last = if periodic { count } else { count.saturating_sub(2) };
        all.extend(
            (0..last)
                .map(|k| [(place(k), 1.0), (place((k + 1) % count), -2.0), (place((k + 2) % count), 1.0)]),
        );
    };
    for column in 0..inner {
        along(&|k| k * inner + column, outer, term.over[0].variable.is_periodic());
    }
    for row in (0..outer).filter(|_| inner > 1) {
        along(&|k| row * inner + k, inner, term.over[1].variable.is_periodic());
    }
    all
}
