//! The rows of a table as the search sees them: which are fitted, which are held out, how fine the readings are, and the
//! natural magnitudes of table and motor.

use super::map;
use crate::gap::dataset::Scales;
use crate::gap::fit::hypothesis::{Data, Item, NUISANCE_BOUND, Slot};
use crate::gap::order::by_least;
use crate::gap::residual::largest;
use crate::system::effects::{Effect, Family, Parameter, Signal, Starts};
use crate::system::log::Table;
use crate::system::model::{Kind, Model};
use crate::system::plant::physics::Physics;

/// From this many rows on, every second one is held out; below, every third. Chosen by judgement; not studied.
const HALVED_FROM: usize = 16;
/// Share of the largest reading below which errors carry no information, whatever the file's digits say. Chosen by
/// judgement; not studied.
const FINEST: f64 = 1e-5;
/// Tolerance of a model that was itself fitted to the log: its values absorb what is missing. The natural logarithm
/// of the ratio has this standard deviation. Over a record it is half of that. Chosen by judgement; not studied.
const FITTED_TOLERANCE: f64 = 1.0;
/// Step of the numeric derivatives. A steady state is exact, so that it may be far smaller than for a simulation.
/// Chosen by judgement; not studied.
const STEP: f64 = 1e-5;
/// Softness from which fits of a limit start that has one. Chosen by judgement; not studied.
const SOFT: [f64; 2] = [0.15, 0.5];
/// Quantiles of a signal at which the fits of a threshold start. Chosen by judgement; not studied.
const QUANTILES: [f64; 5] = [0.97, 0.85, 0.7, 0.5, 0.3];

/// Rows in the order of measurement, and which of them count.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Voltage held, V.
    pub volts: Vec<f64>,
    /// Reading, rad/s.
    pub omega: Vec<f64>,
    /// Rows that are fitted.
    pub fitted: Vec<bool>,
    /// Errors below this rms carry no information: resolution of the readings, rad/s.
    pub resolution: f64,
    /// Natural magnitudes.
    scales: Scales,
    /// How much steeper the table is than the model. A drive whose gain is wrong moves the thresholds behind it, so the
    /// steepest part of the table counts where the model is flatter.
    gain: f64,
}

impl Rows {
    /// The rows of a log, some of them held out unless all are kept.
    pub fn of(log: &Table, model: &Model, keep_all: bool) -> Self {
        let plant = map::visible(model);
        let rows = log.u_v.len();
        let every = if rows < HALVED_FROM { 3 } else { 2 };
        let steepest = steepest(&log.u_v, &log.omega_rad_s);
        // Twenty times the slope of the model is a wrong unit, of which others speak. Chosen by judgement; not studied.
        let gain = (steepest / plant.dc_gain().abs()).clamp(1.0, 20.0);
        Self {
            fitted: (0..rows).map(|k| keep_all || k % every != every - 1).collect(),
            resolution: resolution(log),
            scales: scales(&plant, gain * largest(&log.u_v), largest(&log.omega_rad_s), gain),
            gain,
            volts: log.u_v.clone(),
            omega: log.omega_rad_s.clone(),
        }
    }

    /// Number of fitted rows.
    pub fn count(&self) -> usize {
        self.fitted.iter().filter(|f| **f).count()
    }

    /// The fitted rows of a column.
    pub fn fitted_only(&self, column: &[f64]) -> Vec<f64> {
        let rows = column.iter().zip(&self.fitted);
        rows.filter(|(_, fitted)| **fitted).map(|(v, _)| *v).collect()
    }

    /// The same rows, every one fitted.
    pub fn all_fitted(&self) -> Self {
        Self { fitted: vec![true; self.volts.len()], ..self.clone() }
    }

    /// Reading minus prediction of every row, rad/s.
    pub fn residual(&self, plant: &Physics) -> Vec<f64> {
        minus(&self.omega, &map::sweep(plant, &self.volts))
    }

    /// Reading minus prediction on the fitted rows, rad/s.
    pub fn misfit(&self, plant: &Physics) -> Vec<f64> {
        if plant.breakaway_extra == 0.0 {
            // Without memory a row does not depend on the rows before it.
            let predicted = map::sweep(plant, &self.fitted_only(&self.volts));
            return minus(&self.fitted_only(&self.omega), &predicted);
        }
        self.fitted_only(&self.residual(plant))
    }

    /// The largest voltage, V.
    pub fn top_v(&self) -> f64 {
        largest(&self.volts)
    }

    /// The largest reading, rad/s.
    pub fn largest_speed(&self) -> f64 {
        largest(&self.omega)
    }

    /// Voltages at which the table shows the motor starting from rest, the first of each direction: half-way between the
    /// last row at rest and the first in motion, where the voltage grows in magnitude.
    pub fn restarts(&self) -> Vec<f64> {
        let (volts, omega) = (&self.volts, &self.omega);
        let starts =
            |k: &usize| omega[k - 1] == 0.0 && omega[*k] != 0.0 && volts[*k].abs() > volts[k - 1].abs();
        let places = (1..volts.len()).filter(starts);
        let mut found: Vec<f64> = places.map(|k| 0.5 * (volts[k - 1] + volts[k])).collect();
        found.dedup_by_key(|u| u.signum() as i64);
        found
    }

    /// From where the fits of an effect start beside this plant: values of all its parameters, in units of their scales.
    pub fn starts(&self, item: &Item, plant: &Physics) -> Vec<Vec<f64>> {
        let here = self.scales_beside(plant);
        let parameters = || item.effect.parameters.iter();
        match item.effect.starts {
            _ if item.effect.family == Family::Limit => self.limits(item, plant),
            Starts::Grid(grid) => {
                let ratio = |p: &Parameter| here.of(p.scale) / self.scales.of(p.scale);
                let row = |row: &&[f64]| row.iter().zip(parameters()).map(|(g, p)| g * ratio(p)).collect();
                grid.iter().map(row).collect()
            }
            Starts::Quantiles(signal, _) => {
                let unit = self.scales.of(item.effect.parameters[0].scale);
                let levels = self.levels(signal, plant).into_iter();
                levels.map(|level| vec![level / unit]).collect()
            }
            _ => vec![],
        }
    }

    /// The magnitudes for a plant whose base was refitted: a torque is worth the volts that hold it.
    fn scales_beside(&self, plant: &Physics) -> Scales {
        Scales {
            torque: plant.torque_per_input().abs() * self.scales.input,
            current: self.scales.input / plant.resistance,
            resistance: plant.resistance,
            ..self.scales
        }
    }

    /// A threshold has no gradient where it is not reached: it starts at quantiles of what drives it.
    fn levels(&self, signal: Signal, plant: &Physics) -> [f64; QUANTILES.len()] {
        let volts = self.volts.iter().map(|u| self.gain * u.abs());
        let mut reached: Vec<f64> = match signal {
            Signal::Input => volts.collect(),
            Signal::Speed => self.omega.iter().map(|w| w.abs()).collect(),
            Signal::Current => volts.map(|u| u / plant.resistance).collect(),
        };
        reached.sort_by(f64::total_cmp);
        QUANTILES.map(|q| reached[((reached.len() - 1) as f64 * q) as usize])
    }

    /// The same level for both directions, then the softness: none, or two that are seen.
    fn limits(&self, item: &Item, plant: &Physics) -> Vec<Vec<f64>> {
        let last = item.effect.parameters.len() - 1;
        let softness = if item.pinned(last).is_none() { &SOFT[..] } else { &[0.0] };
        let unit = self.scales.input;
        let start = |level: f64, s: &f64| vec![level / unit; last].into_iter().chain([*s]).collect();
        let levels = self.levels(Signal::Input, plant).into_iter();
        levels.flat_map(|level| softness.iter().map(move |s| start(level, s))).collect()
    }
}

impl Data for Rows {
    fn scales(&self) -> &Scales {
        &self.scales
    }

    /// The base parameters that a steady state sees. Torque constant and back-EMF constant are one number of the motor.
    fn nuisances(&self, model: &Model) -> Vec<Slot> {
        let values = model.parameters();
        let nominal = |key| values.iter().find(|value| value.0 == key).map_or(0.0, |value| value.1);
        let base = |key, twin: Option<&'static str>| {
            let least = if model.fitted_to_log { FITTED_TOLERANCE } else { 1e-9 };
            Slot::Base {
                key,
                nominal: nominal(key),
                tolerance: model.tolerance(key).max(least),
                twin: twin.map(|twin| (twin, nominal(twin))),
            }
        };
        match model.kind {
            Kind::FirstOrder { .. } => vec![base("gain_rad_s_per_v", None)],
            _ => vec![
                base("R_ohm", None),
                base("Kt_nm_per_a", Some("Ke_vs_per_rad")),
                base("b_nms_per_rad", None),
            ],
        }
    }

    fn reach(&self, _: &Model) -> f64 {
        NUISANCE_BOUND
    }

    fn step(&self, _: &Slot, _: Option<&Parameter>) -> f64 {
        STEP
    }

    fn base(&self, model: &Model, kind: &Kind) -> Physics {
        model.base_of(kind)
    }

    fn shows(&self, known: &Effect) -> bool {
        known.counts_in_tables()
    }

    /// Damping that drives the motion does not exist.
    fn tidy(&self, plant: &mut Physics) {
        plant.viscous_pos = plant.viscous_pos.max(-plant.viscous);
        plant.viscous_neg = plant.viscous_neg.max(-plant.viscous);
    }
}

fn scales(plant: &Physics, input: f64, speed: f64, gain: f64) -> Scales {
    let reachable = plant.dc_gain().abs() * input / gain;
    Scales {
        input,
        torque: plant.torque_per_input().abs() * input,
        speed: reachable.max(speed),
        motion: speed,
        time: plant.time_constant_s(),
        current: input / plant.resistance,
        resistance: plant.resistance,
        inertia: plant.inertia,
        reachable,
        duration: 0.0,
    }
}

fn minus(measured: &[f64], predicted: &[f64]) -> Vec<f64> {
    measured.iter().zip(predicted).map(|(y, p)| y - p).collect()
}

/// The steepest slope of a table over at least a tenth of its span, rad/s/V.
fn steepest(volts: &[f64], omega: &[f64]) -> f64 {
    let mut rows: Vec<(f64, f64)> = volts.iter().copied().zip(omega.iter().copied()).collect();
    by_least(&mut rows, |it| it.0);
    let span = rows.last().map_or(0.0, |l| l.0 - rows[0].0);
    let far = |k: usize| {
        let mut further = rows[k..].iter();
        // A tenth of the span apart: the slope is then that of the curve and not of two readings' noise. Judgement; not studied.
        let found = further.find(|r| r.0 - rows[k].0 >= 0.1 * span);
        found.map(|r| (rows[k], *r))
    };
    let slopes = (0..rows.len()).filter_map(far).map(|(a, b)| ((b.1 - a.1) / (b.0 - a.0)).abs());
    slopes.fold(0.0, f64::max)
}

/// Rms of the rounding of the readings, rad/s: from the digits of the file.
fn resolution(log: &Table) -> f64 {
    let unit = log.speed_unit_rad_s;
    let whole = |step: f64| {
        let rounding = |w: &f64| ((w / unit / step).round() * step - w / unit).abs();
        log.omega_rad_s.iter().all(|w| rounding(w) < 1e-7)
    };
    let mut steps = (0..6).map(|digits| 10f64.powi(-digits));
    let step = steps.find(|step| whole(*step)).unwrap_or(1e-6);
    (step * unit / 12f64.sqrt()).max(FINEST * largest(&log.omega_rad_s))
}
