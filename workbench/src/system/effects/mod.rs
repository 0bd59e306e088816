//! The library of physical effects: one file each, one line in [`LIBRARY`].
//!
//! An effect knows its name, equation, published source, bounded parameters, the values from which a fit starts, the
//! trace it leaves in the residual, what it is confused with, and the experiment that separates them. It turns its
//! parameters into [`Physics`]; it knows nothing of the search.

use crate::console::input_error::nearest;
use crate::system::plant::physics::{Drive, Physics};

mod actuator_lag;
mod backlash;
mod base_parameter;
mod cogging;
mod constant_load;
mod coulomb_asymmetric;
mod coulomb_friction;
mod current_limit;
mod dead_zone;
mod drive_gain;
mod encoder_scale;
mod flexible_coupling;
mod gravity;
mod kt_saturation;
mod load_dependent_friction;
mod periodic_load;
mod quadratic_drag;
mod sensor_lag;
mod sensor_offset;
mod sensor_rectified;
mod speed_saturation;
mod stribeck_friction;
mod supply_sag;
mod thermal_resistance;
mod transport_delay;
mod viscous_asymmetric;
mod voltage_drop;
mod voltage_offset;
mod voltage_saturation;

/// Every effect. The order is the order of the plant: input, winding, friction, torques, load, sensor.
pub static LIBRARY: &[Effect] = &[
    dead_zone::SYMMETRIC,
    dead_zone::ASYMMETRIC,
    voltage_saturation::EFFECT,
    voltage_saturation::ASYMMETRIC,
    drive_gain::EFFECT,
    voltage_offset::EFFECT,
    transport_delay::EFFECT,
    actuator_lag::EFFECT,
    voltage_drop::EFFECT,
    supply_sag::EFFECT,
    current_limit::EFFECT,
    base_parameter::RESISTANCE,
    base_parameter::MOTOR_GAIN,
    base_parameter::INERTIA,
    base_parameter::VISCOUS,
    thermal_resistance::EFFECT,
    kt_saturation::EFFECT,
    coulomb_friction::EFFECT,
    coulomb_asymmetric::EFFECT,
    stribeck_friction::EFFECT,
    load_dependent_friction::EFFECT,
    viscous_asymmetric::EFFECT,
    quadratic_drag::EFFECT,
    constant_load::EFFECT,
    gravity::EFFECT,
    cogging::EFFECT,
    periodic_load::EFFECT,
    backlash::EFFECT,
    flexible_coupling::EFFECT,
    encoder_scale::EFFECT,
    speed_saturation::EFFECT,
    sensor_lag::EFFECT,
    sensor_rectified::EFFECT,
    sensor_offset::EFFECT,
];

/// What makes a measured speed late: controllers average the speed that they report over 30 to 220 ms, and send it late.
pub static LAGS: [&Effect; 2] = [&sensor_lag::EFFECT, &transport_delay::EFFECT];
/// What shifts the whole motion to one side: beside a symmetric threshold or friction the same as two different sides.
pub static SHIFTS: [&Effect; 2] = [&voltage_offset::EFFECT, &constant_load::EFFECT];
/// A drive that follows its command so late is rare, and an applied voltage that was logged has its lag behind it.
pub static RARE_LAG: &Effect = &actuator_lag::EFFECT;

/// One physical effect.
#[derive(Debug)]
pub struct Effect {
    /// Published name; never changes.
    pub name: &'static str,
    /// What it is, in one sentence.
    pub summary: &'static str,
    /// The equation, in the symbols of the model file.
    pub equation: &'static str,
    /// Where the equation is published.
    pub source: &'static str,
    /// The trace it leaves in the residual.
    pub signature: &'static str,
    /// Names it is confused with.
    pub confusable_with: &'static [&'static str],
    /// The experiment that separates it from them.
    pub separated_by: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// Where fits start.
    pub starts: Starts,
    /// On which axes it is offered.
    pub axis: Axis,
    /// Effects of one family replace each other; they are never added to each other.
    pub family: Family,
    /// How much it claims beside the plain form of the same thing.
    pub form: Form,
    /// Puts the parameters into the plant.
    pub apply: fn(&[f64], &mut Physics),
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Key in model file and JSON.
    pub name: &'static str,
    /// Unit as text.
    pub unit: &'static str,
    /// What one unit of `lower`, `upper` and the starts means for a given motor.
    pub scale: Scale,
    /// Smallest value, in units of `scale`.
    pub lower: f64,
    /// Largest value, in units of `scale`.
    pub upper: f64,
    /// Value when the key is absent; `None`: the key is required.
    pub default: Option<f64>,
}

impl Parameter {
    /// A required parameter.
    pub const fn new(name: &'static str, unit: &'static str, scale: Scale, lower: f64, upper: f64) -> Self {
        Self {
            name,
            unit,
            scale,
            lower,
            upper,
            default: None,
        }
    }

    /// A parameter that may be absent.
    pub const fn optional(mut self, default: f64) -> Self {
        self.default = Some(default);
        self
    }

    /// Whether it measures how much of the effect there is, in a unit: at 0 there is none. Thresholds, ratios and phases do not.
    pub fn is_size(&self) -> bool {
        self.scale != Scale::One && self.lower <= 0.0 && self.default.is_none()
    }

    /// Whether it measures how much of the effect there is: a size, a share (a plain number from 0 on), or a ratio.
    pub fn measures(&self) -> bool {
        let share = self.scale == Scale::One && self.lower == 0.0 && self.default.is_none();
        self.is_size() || share || self.is_ratio()
    }

    /// The value at which there is nothing of the effect.
    pub fn nothing(&self) -> f64 {
        if self.is_ratio() { 1.0 } else { 0.0 }
    }

    fn is_ratio(&self) -> bool {
        self.name == "ratio"
    }
}

/// What a parameter is measured by: the natural magnitudes of a motor and its log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// A plain number.
    One,
    /// The largest input in the log.
    Input,
    /// Torque at the largest input and standstill.
    Torque,
    /// Steady speed at the largest input.
    Speed,
    /// Mechanical time constant.
    Time,
    /// Current at the largest input and standstill.
    Current,
    /// The winding's resistance.
    Resistance,
    /// Torque over speed.
    Viscous,
    /// Torque over speed squared.
    Drag,
    /// Speed times time constant: the angle of one time constant.
    Angle,
    /// One over the time constant, in Hz.
    Frequency,
    /// Inverse of the largest copper loss.
    PerPower,
    /// Inertia over time constant squared.
    Stiffness,
    /// Time constant over resistance.
    Capacity,
}

/// Where the fits of an effect start, in units of the parameters' scales.
#[derive(Clone, Copy, Debug)]
pub enum Starts {
    /// These.
    Grid(&'static [&'static [f64]]),
    /// These, where the cost is so rugged between them that no derivative leads on: the most promising one is where an
    /// evolution begins, with these relative standard deviations of the parameters.
    Rugged(&'static [&'static [f64]], &'static [f64]),
    /// The first parameter at quantiles of a signal of the simulation (a threshold has no gradient where it is not
    /// reached); the others at these values.
    Quantiles(Signal, &'static [f64]),
    /// One sine per turn of the load, fitted to the missing torque, gives amplitude and phase.
    GravityScan,
    /// One scan of the missing torque over periods per turn finds period, amplitude and phase.
    PositionScan,
    /// One scan of the missing torque over frequency finds frequency, amplitude and phase.
    TimeScan,
}

impl Starts {
    /// The starts that do not depend on the log.
    pub fn rows(&self) -> &'static [&'static [f64]] {
        match *self {
            Self::Grid(rows) | Self::Rugged(rows, _) => rows,
            _ => &[],
        }
    }

    /// Whether a period is looked for among dozens: one of them always explains something.
    pub fn scans(&self) -> bool {
        matches!(self, Self::PositionScan | Self::TimeScan)
    }
}

/// A signal of the simulation whose quantiles start a threshold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// |input|.
    Input,
    /// |speed|.
    Speed,
    /// |current|.
    Current,
}

/// The axes on which an effect makes sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Every axis.
    Any,
    /// Only where a voltage drives a winding whose resistance and constant the model tells.
    Winding,
    /// Only where the current is known: behind such a winding, or because the input is a current or torque.
    Current,
    /// Only where the axis turns (no sine of a position on a linear axis).
    Rotary,
}

/// Effects that describe the same place of the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Stands alone.
    Own(&'static str),
    /// Dead zones of the input.
    DeadZone,
    /// Friction that does not grow with speed.
    DryFriction,
    /// Friction in proportion to the speed.
    Viscous,
}

/// How much an effect claims. It matters for a model that is a fit to the log of a real rig: a rich form wins such a log by a
/// hair and fails on the next record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The plain form.
    Plain,
    /// A form with more freedom: two sides instead of one, a second level, a second body, a period that is looked for.
    Rich,
    /// The same, unless the log holds the position on which it acts.
    RichWithoutPosition,
    /// A number that the fit of the model has taken up already.
    Absorbed,
}

impl Effect {
    /// Whether the effect is offered on such an axis. `winding`: the model tells what the winding does; a first-order
    /// model does not say how much of its damping is back-EMF, so nobody knows its current.
    pub fn fits(&self, drive: Drive, winding: bool, linear: bool) -> bool {
        match self.axis {
            Axis::Any => true,
            Axis::Winding => drive == Drive::Voltage && winding,
            Axis::Current => drive == Drive::Torque || winding,
            Axis::Rotary => !linear,
        }
    }

    /// True if a start moves an optional parameter away from its default.
    pub fn moves_option(&self, start: &[f64]) -> bool {
        let pairs = self.parameters.iter().zip(start);
        pairs
            .filter_map(|(parameter, value)| Some((parameter.default?, value)))
            .any(|(default, value)| default != *value)
    }

    /// True if the effect frees a base parameter from its tolerance instead of adding something.
    pub fn is_base_parameter(&self) -> bool {
        matches!(
            self.name,
            "resistance" | "motor_gain" | "inertia" | "viscous_friction"
        )
    }
}

/// The effect of that name. `coulomb`, `stribeck`, `viscous` and `gravity_arm` are read as aliases.
pub fn find(name: &str) -> Option<&'static Effect> {
    let name = match name {
        "coulomb" => "coulomb_friction",
        "stribeck" => "stribeck_friction",
        "viscous" => "viscous_friction",
        "gravity_arm" => "gravity",
        other => other,
    };
    LIBRARY.iter().find(|effect| effect.name == name)
}

/// The effect of that name, or a sentence that says which one is near.
pub fn known(name: &str) -> Result<&'static Effect, String> {
    find(name).ok_or_else(|| {
        let near = nearest(name, LIBRARY.iter().map(|effect| effect.name));
        let near = near.map_or(String::new(), |near| format!("; the nearest is `{near}`"));
        format!("`{name}` is no effect of the library{near}; `truing effects` lists them")
    })
}

/// A parameter's or effect's key on a linear axis: `_nm` reads `_n`, `_rad` reads `_m`.
pub fn linear_key(name: &str) -> String {
    name.replace("_nm", "_n").replace("_rad", "_m")
}

/// A unit on a linear axis.
pub fn linear_unit(unit: &str) -> String {
    unit.replace("N m", "N").replace("rad", "m")
}
