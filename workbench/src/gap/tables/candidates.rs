//! Which effects of the library leave a trace in a steady state, in which forms they are tried, and by what their
//! parameters are measured.

use crate::system::effects::{Effect, Family, Forms, LIBRARY, Needs, Role, Scale, Signal, Starts};
use crate::system::model::Model;
use crate::system::plant::physics::{Drive, Physics};

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

/// Whether two effects describe the same place, so that one replaces the other. The damping of the base and a further one
/// that differs between the directions add up.
pub fn same_place(a: &Effect, b: &Effect) -> bool {
    a == b || (a.same_family(b) && a.family != Family::Viscous)
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
        let library = LIBRARY.iter().copied();
        library.filter(|effect| self.allows(effect)).collect()
    }

    /// The forms that the search tries.
    pub fn forms(&self) -> Vec<Form> {
        self.in_role(Role::Representative)
    }

    /// The forms that are tried on top of a set.
    pub fn refinements(&self) -> Vec<Form> {
        self.in_role(Role::Refinement)
    }

    /// Voltages at which the table shows the motor starting from rest, the first of each direction.
    pub fn restarts(&self) -> &[f64] {
        &self.restarts
    }

    fn in_role(&self, role: Role) -> Vec<Form> {
        let effects = self.effects().into_iter();
        let chosen = effects.filter(|effect| effect.steady().is_some_and(|steady| steady.role == role));
        chosen.flat_map(forms).collect()
    }

    fn allows(&self, effect: &Effect) -> bool {
        effect.steady().is_some_and(|steady| self.holds(steady.needs))
            && !self.taken.iter().any(|taken| same_place(taken, effect))
            && effect.fits(Drive::Voltage, self.winding, false)
            && !(self.fitted_to_log && effect.is_scale())
    }

    /// Whether model and table hold what an effect needs to be seen.
    fn holds(&self, needs: Needs) -> bool {
        match needs {
            Needs::Nothing => true,
            Needs::Winding => self.winding,
            Needs::Reversal => self.reversed,
            Needs::Magnitudes => self.reversed && self.rectifiable,
        }
    }
}

/// The forms in which an effect is tried.
pub fn forms(effect: &'static Effect) -> Vec<Form> {
    let optional = effect.parameters.iter().any(|p| p.default.is_some());
    match effect.steady().map(|steady| steady.forms) {
        Some(Forms::FromRest(pinned)) => vec![Form {
            effect,
            pinned: pinned.to_vec(),
        }],
        Some(Forms::Plain) => vec![Form::plain(effect)],
        _ if optional => vec![Form::plain(effect), Form::free(effect)],
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
            _ if form.effect.family == Family::Limit => self.limits(form),
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
