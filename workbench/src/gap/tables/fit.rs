//! One set of effects fitted to a steady-state table: least squares with the base parameters as nuisances.
//!
//! Minimised is Σ((y − ŷ)/σ)² + Σ(δ/tolerance)², δ = ln(fitted/nominal) of the base parameters, within ±2 tolerances
//! (Levenberg–Marquardt, steps projected onto the bounds). σ is not known beforehand: it starts at the residual of the
//! start and is found by repetition, so that a model that lacks something does not bend its base to hide it.

use super::candidates::{Form, Natural};
use super::map;
use crate::system::model::{Kind, Model};
use crate::system::plant::physics::Physics;
use nalgebra::{DMatrix, DVector};

/// Iterations of one descent.
const ITERATIONS: usize = 20;
/// Relative decrease of the cost at which a descent ends (twice in a row).
const CONVERGED: f64 = 1e-5;
/// A base parameter moves by at most this many tolerances.
const REACH: f64 = 2.0;
/// Tolerance of a model that was itself fitted to the log: its values absorb what is missing.
/// The natural logarithm of the ratio has this standard deviation.
const FITTED_TOLERANCE: f64 = 1.0;

/// A base parameter that is uncertain: its keys in the model file and its tolerance (relative, 1 σ).
#[derive(Clone, Debug)]
pub struct Nuisance {
    /// Keys that move together.
    pub keys: &'static [&'static str],
    /// Relative, 1 σ.
    pub tolerance: f64,
    apply: fn(&mut Physics, f64),
}

/// The base parameters that a steady state sees.
pub fn nuisances(model: &Model) -> Vec<Nuisance> {
    let one = |keys: &'static [&'static str], apply: fn(&mut Physics, f64)| {
        let declared = model.tolerance(keys[0]);
        let tolerance = if model.fitted_to_log {
            declared.max(FITTED_TOLERANCE)
        } else {
            declared
        };
        Nuisance {
            keys,
            tolerance: tolerance.max(1e-9),
            apply,
        }
    };
    match model.kind {
        Kind::FirstOrder { .. } => vec![one(&["gain_rad_s_per_v"], |p, ratio| {
            p.kt /= ratio;
            p.ke /= ratio;
        })],
        _ => vec![
            one(&["R_ohm"], |p, ratio| p.resistance *= ratio),
            one(&["Kt_nm_per_a", "Ke_vs_per_rad"], |p, ratio| {
                p.kt *= ratio;
                p.ke *= ratio;
            }),
            one(&["b_nms_per_rad"], |p, ratio| p.viscous *= ratio),
        ],
    }
}

/// The data of a fit: rows in the order of measurement, and which of them count.
#[derive(Clone, Debug)]
pub struct Data {
    /// Voltage held, V.
    pub volts: Vec<f64>,
    /// Reading, rad/s.
    pub omega: Vec<f64>,
    /// Rows that are fitted.
    pub fitted: Vec<bool>,
    /// Errors below this rms carry no information: resolution of the readings, rad/s.
    pub resolution: f64,
}

impl Data {
    /// Number of fitted rows.
    pub fn rows(&self) -> usize {
        self.fitted.iter().filter(|f| **f).count()
    }

    /// The fitted rows of a column.
    pub fn fitted_only(&self, column: &[f64]) -> Vec<f64> {
        column
            .iter()
            .zip(&self.fitted)
            .filter(|(_, fitted)| **fitted)
            .map(|(v, _)| *v)
            .collect()
    }

    /// The same data with every row fitted.
    pub fn whole(&self) -> Data {
        Data {
            fitted: vec![true; self.volts.len()],
            ..self.clone()
        }
    }
}

/// What is fitted: base, nuisances, scales.
pub struct Problem<'a> {
    /// The plant of the model as given.
    pub base: &'a Physics,
    /// Its uncertain parameters.
    pub nuisances: &'a [Nuisance],
    /// Natural magnitudes.
    pub natural: &'a Natural,
    /// Rows.
    pub data: &'a Data,
}

/// A fitted set of effects.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The effects in the form in which they were fitted.
    pub forms: Vec<Form>,
    /// Fitted parameters, form after form, then the shifts of the base.
    pub x: Vec<f64>,
    /// Mean squared residual of the fitted rows, (rad/s)².
    pub mean_square: f64,
    /// Σ(δ/tolerance)².
    pub prior: f64,
}

impl Fit {
    /// Number of fitted effect parameters.
    pub fn size(&self) -> usize {
        self.forms.iter().map(Form::size).sum()
    }

    /// Parameters of effect k, pinned ones included.
    pub fn values(&self, k: usize) -> Vec<f64> {
        let start: usize = self.forms[..k].iter().map(Form::size).sum();
        self.forms[k].values(&self.x[start..start + self.forms[k].size()])
    }

    /// ln(fitted/nominal) of the base parameters.
    pub fn shifts(&self) -> &[f64] {
        &self.x[self.size()..]
    }
}

impl Problem<'_> {
    /// The plant with these effects and parameters.
    pub fn plant(&self, forms: &[Form], x: &[f64]) -> Physics {
        let mut plant = self.base.clone();
        let size: usize = forms.iter().map(Form::size).sum();
        for (nuisance, shift) in self.nuisances.iter().zip(&x[size..]) {
            (nuisance.apply)(&mut plant, shift.exp());
        }
        let mut rest = &x[..size];
        for form in forms {
            let (own, others) = rest.split_at(form.size());
            (form.effect.apply)(&form.values(own), &mut plant);
            rest = others;
        }
        // Damping that drives the motion does not exist.
        plant.viscous_pos = plant.viscous_pos.max(-plant.viscous);
        plant.viscous_neg = plant.viscous_neg.max(-plant.viscous);
        plant
    }

    /// Readings of the fitted set for every row.
    pub fn predict(&self, fit: &Fit) -> Vec<f64> {
        map::sweep(&self.plant(&fit.forms, &fit.x), &self.data.volts)
    }

    /// The best fit over several starts; each start holds effect parameters and shifts.
    pub fn best(&self, forms: &[Form], starts: &[Vec<f64>]) -> Option<Fit> {
        let fits = starts.iter().map(|s| self.descend(forms, s));
        fits.min_by(|a, b| self.cost_of(a).total_cmp(&self.cost_of(b)))
    }

    fn cost_of(&self, fit: &Fit) -> f64 {
        self.data.rows() as f64 * (fit.mean_square + self.data.resolution.powi(2)).ln() + fit.prior
    }

    /// How good a start is, before any descent.
    pub fn promise(&self, forms: &[Form], start: &[f64]) -> f64 {
        mean_square(&self.misfit(forms, start))
    }

    fn descend(&self, forms: &[Form], start: &[f64]) -> Fit {
        let scales = self.scales(forms);
        let mut x = start.to_vec();
        scales.clip(&mut x);
        // σ follows the residual: a fit that improves tightens the data against the priors.
        for _ in 0..3 {
            let before = x.clone();
            let sigma = self.sigma(forms, &x);
            x = self.levenberg_marquardt(forms, x, &scales, sigma);
            if x.iter()
                .zip(&before)
                .zip(&scales.unit)
                .all(|((a, b), s)| (a - b).abs() < 1e-6 * s)
            {
                break;
            }
        }
        self.fit(forms, x)
    }

    fn fit(&self, forms: &[Form], x: Vec<f64>) -> Fit {
        let size: usize = forms.iter().map(Form::size).sum();
        let prior = self
            .nuisances
            .iter()
            .zip(&x[size..])
            .map(|(n, d)| (d / n.tolerance).powi(2))
            .sum();
        let mean_square = mean_square(&self.misfit(forms, &x));
        Fit {
            forms: forms.to_vec(),
            x,
            mean_square,
            prior,
        }
    }

    fn sigma(&self, forms: &[Form], x: &[f64]) -> f64 {
        (mean_square(&self.misfit(forms, x)) + self.data.resolution.powi(2)).sqrt()
    }

    /// Reading minus prediction on the fitted rows, rad/s.
    fn misfit(&self, forms: &[Form], x: &[f64]) -> Vec<f64> {
        let plant = self.plant(forms, x);
        if plant.breakaway_extra == 0.0 {
            // Without memory a row does not depend on the rows before it.
            let predicted = map::sweep(&plant, &self.data.fitted_only(&self.data.volts));
            return self
                .data
                .fitted_only(&self.data.omega)
                .iter()
                .zip(&predicted)
                .map(|(y, p)| y - p)
                .collect();
        }
        let predicted = map::sweep(&plant, &self.data.volts);
        let misfit: Vec<f64> = self
            .data
            .omega
            .iter()
            .zip(&predicted)
            .map(|(y, p)| y - p)
            .collect();
        self.data.fitted_only(&misfit)
    }

    /// Misfit over σ, then the shifts over their tolerances.
    fn weighted(&self, forms: &[Form], x: &[f64], sigma: f64) -> DVector<f64> {
        let size: usize = forms.iter().map(Form::size).sum();
        let rows = self.misfit(forms, x).into_iter().map(|r| r / sigma);
        let shifts = self
            .nuisances
            .iter()
            .zip(&x[size..])
            .map(|(n, d)| -d / n.tolerance);
        DVector::from_vec(rows.chain(shifts).collect())
    }

    fn levenberg_marquardt(&self, forms: &[Form], mut x: Vec<f64>, scales: &Scales, sigma: f64) -> Vec<f64> {
        let mut residual = self.weighted(forms, &x, sigma);
        let (mut damping, mut quiet) = (1e-2, 0);
        for _ in 0..ITERATIONS {
            let jacobian = self.jacobian(forms, &x, scales, sigma, &residual);
            let before = residual.norm_squared();
            let mut improved = false;
            for _ in 0..8 {
                let Some(trial) = scales.step(&x, &jacobian, &residual, damping) else {
                    break;
                };
                let next = self.weighted(forms, &trial, sigma);
                if next.norm_squared() < before {
                    (x, residual, improved) = (trial, next, true);
                    damping = (damping / 8.0).max(1e-12);
                    break;
                }
                damping *= 6.0;
            }
            let decrease = (before - residual.norm_squared()) / before;
            quiet = if decrease < CONVERGED { quiet + 1 } else { 0 };
            if !improved || quiet == 2 {
                break;
            }
        }
        x
    }

    /// ∂residual/∂(x/unit), by differences; a step that would cross the upper bound goes down.
    fn jacobian(
        &self,
        forms: &[Form],
        x: &[f64],
        scales: &Scales,
        sigma: f64,
        at: &DVector<f64>,
    ) -> DMatrix<f64> {
        let columns = (0..x.len()).map(|j| {
            let width = scales.difference(x, j);
            let mut moved = x.to_vec();
            moved[j] += width;
            (self.weighted(forms, &moved, sigma) - at) * (scales.unit[j] / width)
        });
        DMatrix::from_columns(&columns.collect::<Vec<_>>())
    }

    fn scales(&self, forms: &[Form]) -> Scales {
        let mut scales = Scales {
            unit: vec![],
            lower: vec![],
            upper: vec![],
        };
        for form in forms {
            let free = form
                .effect
                .parameters
                .iter()
                .zip(&form.pinned)
                .filter(|(_, pin)| pin.is_none());
            for (p, _) in free {
                let unit = self.natural.unit(p.scale);
                scales.push(unit, unit * p.lower, unit * p.upper);
            }
        }
        for n in self.nuisances {
            scales.push(n.tolerance, -REACH * n.tolerance, REACH * n.tolerance);
        }
        scales
    }

    /// Covariance of the fitted parameters and shifts (posterior), σ² from the residual; `None` where it is singular.
    pub fn covariance(&self, fit: &Fit) -> Option<DMatrix<f64>> {
        let scales = self.scales(&fit.forms);
        let degrees = (self.data.rows() as f64 - fit.size() as f64).max(1.0);
        let sigma =
            (fit.mean_square * self.data.rows() as f64 / degrees + self.data.resolution.powi(2)).sqrt();
        let at = self.weighted(&fit.forms, &fit.x, sigma);
        let jacobian = self.jacobian(&fit.forms, &fit.x, &scales, sigma, &at);
        let mut information = jacobian.transpose() * &jacobian;
        // A parameter that sits where the data do not feel it keeps the width of its bounds, not infinity.
        for j in 0..fit.x.len() {
            let reach = (scales.upper[j] - scales.lower[j]) / scales.unit[j];
            information[(j, j)] += 1.0 / (reach * reach);
        }
        let inverse = information.try_inverse()?;
        Some(DMatrix::from_fn(fit.x.len(), fit.x.len(), |i, j| {
            inverse[(i, j)] * scales.unit[i] * scales.unit[j]
        }))
    }
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64
}

/// Units and bounds of what is fitted.
struct Scales {
    unit: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Scales {
    fn push(&mut self, unit: f64, lower: f64, upper: f64) {
        self.unit.push(unit);
        self.lower.push(lower);
        self.upper.push(upper);
    }

    fn clip(&self, x: &mut [f64]) {
        for (j, value) in x.iter_mut().enumerate() {
            *value = value.clamp(self.lower[j], self.upper[j]);
        }
    }

    fn difference(&self, x: &[f64], j: usize) -> f64 {
        let width = 1e-5 * self.unit[j];
        if x[j] + width > self.upper[j] {
            -width
        } else {
            width
        }
    }

    /// The damped Gauss–Newton step. A parameter at a bound that would be pushed through it stays where it is.
    fn step(
        &self,
        x: &[f64],
        jacobian: &DMatrix<f64>,
        residual: &DVector<f64>,
        damping: f64,
    ) -> Option<Vec<f64>> {
        let gradient = jacobian.transpose() * residual;
        let free: Vec<usize> = (0..x.len())
            .filter(|&j| !self.blocked(x, j, gradient[j]))
            .collect();
        let normal = jacobian.transpose() * jacobian;
        let size = free.len();
        let reduced = DMatrix::from_fn(size, size, |a, b| {
            let value = normal[(free[a], free[b])];
            if a == b {
                value * (1.0 + damping) + 1e-12
            } else {
                value
            }
        });
        let step = reduced
            .cholesky()?
            .solve(&DVector::from_fn(size, |a, _| -gradient[free[a]]));
        let mut moved = x.to_vec();
        for (a, j) in free.into_iter().enumerate() {
            moved[j] += step[a] * self.unit[j];
        }
        self.clip(&mut moved);
        Some(moved)
    }

    fn blocked(&self, x: &[f64], j: usize, gradient: f64) -> bool {
        (x[j] <= self.lower[j] && gradient > 0.0) || (x[j] >= self.upper[j] && gradient < 0.0)
    }
}
