//! Which effects of the library leave a trace in a steady state, in which forms they are tried, and by what their
//! parameters are measured.

use crate::system::effects::{Effect, Family, LIBRARY, Scale, Signal, Starts};
use crate::system::model::Model;
use crate::system::plant::physics::{Drive, Physics};

/// Effects that change a steady state. What only delays, and what averages out over a turn, does not.
const VISIBLE: [&str; 22] = [
    "dead_zone",
    "dead_zone_asymmetric",
    "voltage_saturation",
    "voltage_saturation_asymmetric",
    "drive_gain",
    "voltage_offset",
    "voltage_drop",
    "supply_sag",
    "current_limit",
    "resistance",
    "motor_gain",
    "viscous_friction",
    "coulomb_friction",
    "coulomb_asymmetric",
    "stribeck_friction",
    "viscous_asymmetric",
    "quadratic_drag",
    "constant_load",
    "encoder_scale",
    "speed_saturation",
    "sensor_rectified",
    "sensor_offset",
];

/// One effect of each kind of trace: what the search tries first. The others enter as rivals of those that are found.
const REPRESENTATIVES: [&str; 11] = [
    "drive_gain",
    "dead_zone",
    "dead_zone_asymmetric",
    "voltage_saturation",
    "voltage_saturation_asymmetric",
    "voltage_offset",
    "constant_load",
    "sensor_offset",
    "supply_sag",
    "quadratic_drag",
    "sensor_rectified",
];

/// Effects that refine a set that was found: they matter near standstill, or tell one direction from the other.
const REFINEMENTS: [&str; 2] = ["stribeck_friction", "viscous_asymmetric"];

/// What only a model with a winding has apart from its gain.
const NEEDS_WINDING: &str = "viscous_friction";

/// Effects that only an input in both directions can show.
const NEEDS_REVERSAL: [&str; 5] = [
    "dead_zone_asymmetric",
    "voltage_saturation_asymmetric",
    "coulomb_asymmetric",
    "viscous_asymmetric",
    "sensor_rectified",
];

/// An effect with some of its parameters pinned to a value.
#[derive(Clone, Debug)]
pub struct Form {
    /// The effect.
    pub effect: &'static Effect,
    /// Value of each pinned parameter; `None`: it is fitted.
    pub pinned: Vec<Option<f64>>,
}

impl Form {
    /// Every parameter is fitted.
    pub fn free(effect: &'static Effect) -> Self {
        Form {
            effect,
            pinned: vec![None; effect.parameters.len()],
        }
    }

    /// The optional parameters keep their default: the simplest form.
    pub fn plain(effect: &'static Effect) -> Self {
        Form {
            effect,
            pinned: effect.parameters.iter().map(|p| p.default).collect(),
        }
    }

    /// Number of fitted parameters.
    pub fn size(&self) -> usize {
        self.pinned.iter().filter(|p| p.is_none()).count()
    }

    /// All parameters of the effect from the fitted ones.
    pub fn values(&self, fitted: &[f64]) -> Vec<f64> {
        let mut rest = fitted.iter();
        self.pinned
            .iter()
            .map(|p| p.or_else(|| rest.next().copied()).unwrap_or(0.0))
            .collect()
    }
}

/// Whether two effects describe the same place, so that one replaces the other.
pub fn same_place(a: &Effect, b: &Effect) -> bool {
    let shared = matches!(
        a.family,
        Family::DeadZone | Family::DryFriction | Family::Own("limit")
    );
    a.name == b.name || (shared && a.family == b.family)
}

/// What the candidates are drawn from.
pub struct Offer {
    /// Natural magnitudes.
    pub natural: Natural,
    winding: bool,
    reversed: bool,
    fitted_to_log: bool,
    rectifiable: bool,
    restarts: Vec<f64>,
    taken: Vec<&'static Effect>,
}

impl Offer {
    /// The offer for a model and a table.
    pub fn new(model: &Model, plant: &Physics, volts: &[f64], omega: &[f64]) -> Self {
        let winding = matches!(model.kind, crate::system::model::Kind::DcMotor { .. });
        let negative = || volts.iter().zip(omega).filter(|(u, _)| **u < 0.0);
        Offer {
            natural: Natural::new(plant, volts, omega),
            winding,
            reversed: negative().next().is_some() && volts.iter().any(|u| *u > 0.0),
            fitted_to_log: model.fitted_to_log,
            rectifiable: omega.iter().all(|w| *w >= 0.0) && negative().any(|(_, w)| *w > 0.0),
            restarts: restarts(volts, omega),
            taken: model.known.iter().map(|k| k.effect).collect(),
        }
    }

    /// Every effect that could be named from this table.
    pub fn effects(&self) -> Vec<&'static Effect> {
        LIBRARY
            .iter()
            .filter(|e| VISIBLE.contains(&e.name) && self.allows(e))
            .collect()
    }

    /// The forms that the search tries.
    pub fn forms(&self) -> Vec<Form> {
        self.among(&REPRESENTATIVES)
    }

    /// The forms that are tried on top of a set.
    pub fn refinements(&self) -> Vec<Form> {
        self.among(&REFINEMENTS)
    }

    /// Voltages at which the table shows the motor starting from rest, the first of each direction.
    pub fn restarts(&self) -> &[f64] {
        &self.restarts
    }

    fn among(&self, names: &[&str]) -> Vec<Form> {
        self.effects()
            .into_iter()
            .filter(|e| names.contains(&e.name))
            .flat_map(forms)
            .collect()
    }

    fn allows(&self, effect: &Effect) -> bool {
        let scale = effect.is_base_parameter() || matches!(effect.name, "drive_gain" | "encoder_scale");
        !self.taken.iter().any(|t| same_place(t, effect))
            && effect.fits(Drive::Voltage, self.winding, false)
            && (self.winding || effect.name != NEEDS_WINDING)
            && (self.reversed || !NEEDS_REVERSAL.contains(&effect.name))
            && (self.rectifiable || effect.name != "sensor_rectified")
            && !(self.fitted_to_log && scale)
    }
}

/// The forms of an effect: with its optional parameters at their defaults, and with them fitted. Friction with a
/// breakaway level is tried as breakaway alone, because a steady state cannot tell its kinetic level from a dead zone.
pub fn forms(effect: &'static Effect) -> Vec<Form> {
    match effect.name {
        "stribeck_friction" => vec![Form {
            effect,
            pinned: vec![Some(0.0), None, None],
        }],
        "supply_sag" => vec![Form::plain(effect)],
        _ if effect.parameters.iter().any(|p| p.default.is_some()) => {
            vec![Form::plain(effect), Form::free(effect)]
        }
        _ => vec![Form::free(effect)],
    }
}

/// Natural magnitudes: what one unit of a bound or a start means.
#[derive(Clone, Debug)]
pub struct Natural {
    input: f64,
    speed: f64,
    torque: f64,
    current: f64,
    resistance: f64,
    viscous: f64,
    inputs: Vec<f64>,
    speeds: Vec<f64>,
}

impl Natural {
    /// From the model as given and the table. A drive whose gain is wrong moves the thresholds behind it, so the steepest
    /// part of the table counts where the model is flatter.
    fn new(plant: &Physics, volts: &[f64], omega: &[f64]) -> Self {
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let (u, w) = (largest(volts), largest(omega));
        let expected = plant.dc_gain().abs() * u;
        let gain = (steepest(volts, omega) / plant.dc_gain().abs()).clamp(1.0, 20.0);
        let torque = plant.torque_per_input().abs() * u * gain;
        let magnitudes = |values: &[f64], scale: f64| values.iter().map(|v| scale * v.abs()).collect();
        Natural {
            input: u * gain,
            speed: expected.max(w),
            torque,
            current: u * gain / plant.resistance,
            resistance: plant.resistance,
            viscous: torque / expected.max(w),
            inputs: magnitudes(volts, gain),
            speeds: magnitudes(omega, 1.0),
        }
    }

    /// One unit of a scale. Scales that need time do not occur in steady states.
    pub fn unit(&self, scale: Scale) -> f64 {
        match scale {
            Scale::Input => self.input,
            Scale::Torque => self.torque,
            Scale::Speed => self.speed,
            Scale::Current => self.current,
            Scale::Resistance => self.resistance,
            Scale::Viscous => self.viscous,
            Scale::Drag => self.viscous / self.speed,
            Scale::PerPower => 1.0 / (self.current * self.current * self.resistance),
            _ => 1.0,
        }
    }

    /// The same magnitudes for a plant whose base was refitted: a torque is worth the volts that hold it.
    pub fn of_plant(&self, plant: &Physics) -> Natural {
        let torque = plant.torque_per_input().abs() * self.input;
        Natural {
            torque,
            current: self.input / plant.resistance,
            resistance: plant.resistance,
            viscous: torque / self.speed,
            ..self.clone()
        }
    }

    /// Start values of the fitted parameters of a form.
    pub fn starts(&self, form: &Form) -> Vec<Vec<f64>> {
        self.full_starts(form)
            .into_iter()
            .map(|s| unpinned(form, &s))
            .collect()
    }

    fn full_starts(&self, form: &Form) -> Vec<Vec<f64>> {
        let units: Vec<f64> = form
            .effect
            .parameters
            .iter()
            .map(|p| self.unit(p.scale))
            .collect();
        match form.effect.starts {
            _ if form.effect.family == Family::Own("limit") => self.limits(form),
            Starts::Grid(grid) => grid.iter().map(|g| scaled(g, &units)).collect(),
            Starts::Quantiles(signal, _) => {
                self.levels(signal).into_iter().map(|level| vec![level]).collect()
            }
            _ => vec![],
        }
    }

    /// A threshold has no gradient where it is not reached: it starts at quantiles of what drives it.
    fn levels(&self, signal: Signal) -> Vec<f64> {
        let mut reached = match signal {
            Signal::Input => self.inputs.clone(),
            Signal::Speed => self.speeds.clone(),
            Signal::Current => self.inputs.iter().map(|u| u / self.resistance).collect(),
        };
        reached.sort_by(f64::total_cmp);
        let at = |q: f64| reached[((reached.len() - 1) as f64 * q) as usize];
        [0.97, 0.85, 0.7, 0.5, 0.3].map(at).to_vec()
    }

    /// The same level for both directions, then the softness: none, or two that are seen.
    fn limits(&self, form: &Form) -> Vec<Vec<f64>> {
        let last = form.effect.parameters.len() - 1;
        let softness: &[f64] = if form.pinned[last].is_none() {
            &[0.15, 0.5]
        } else {
            &[0.0]
        };
        let levels = self.levels(Signal::Input);
        let start = |level: &f64, s: &f64| (0..last).map(|_| *level).chain([*s]).collect();
        levels
            .iter()
            .flat_map(|level| softness.iter().map(move |s| start(level, s)))
            .collect()
    }
}

/// Half-way between the last row at rest and the first in motion, where the voltage grows in magnitude.
fn restarts(volts: &[f64], omega: &[f64]) -> Vec<f64> {
    let starts = |k: &usize| omega[k - 1] == 0.0 && omega[*k] != 0.0 && volts[*k].abs() > volts[k - 1].abs();
    let mut found: Vec<f64> = (1..volts.len())
        .filter(starts)
        .map(|k| 0.5 * (volts[k - 1] + volts[k]))
        .collect();
    found.dedup_by_key(|u| u.signum() as i64);
    found
}

/// The steepest slope of a table over at least a tenth of its span, rad/s/V.
fn steepest(volts: &[f64], omega: &[f64]) -> f64 {
    let mut rows: Vec<(f64, f64)> = volts.iter().copied().zip(omega.iter().copied()).collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let span = rows.last().map_or(0.0, |l| l.0 - rows[0].0);
    let far = |k: usize| {
        rows[k..]
            .iter()
            .find(|r| r.0 - rows[k].0 >= 0.1 * span)
            .map(|r| (rows[k], *r))
    };
    let slopes = (0..rows.len())
        .filter_map(far)
        .map(|(a, b)| ((b.1 - a.1) / (b.0 - a.0)).abs());
    slopes.fold(0.0, f64::max)
}

fn scaled(start: &[f64], units: &[f64]) -> Vec<f64> {
    start.iter().zip(units).map(|(s, u)| s * u).collect()
}

fn unpinned(form: &Form, values: &[f64]) -> Vec<f64> {
    form.pinned
        .iter()
        .zip(values)
        .filter(|(p, _)| p.is_none())
        .map(|(_, v)| *v)
        .collect()
}
