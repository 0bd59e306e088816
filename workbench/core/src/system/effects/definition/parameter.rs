//! The parameters of an effect, and the natural magnitudes by which they are measured.

use super::OnChip;

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
    /// What kind of quantity it is.
    pub meaning: Meaning,
    /// True if the firmware has a number for it, if it has one for the effect.
    pub on_chip: OnChip,
}

/// The kinds of quantities that a fit, a prior or a report treats in their own way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Any other quantity.
    Quantity,
    /// A factor; 1 means that there is nothing of the effect.
    Ratio,
    /// An angle of a sine, rad; a whole turn more is the same.
    Phase,
    /// Periods per turn of the shaft.
    PeriodsPerTurn,
    /// A frequency in time, Hz.
    Frequency,
    /// How a log begins: it says nothing of another log.
    AtStart,
    /// No reading lies above it.
    Ceiling,
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
            meaning: Meaning::Quantity,
            on_chip: OnChip::Known,
        }
    }

    /// A parameter that may be absent.
    pub const fn optional(mut self, default: f64) -> Self {
        self.default = Some(default);
        self
    }

    /// A parameter that means this.
    pub const fn meaning(mut self, meaning: Meaning) -> Self {
        self.meaning = meaning;
        self
    }

    /// A parameter for which the firmware has no number.
    pub const fn unknown_on_chip(mut self) -> Self {
        self.on_chip = OnChip::Unknown;
        self
    }

    /// True if it measures how much of the effect there is, in a unit: at 0 there is none. Thresholds, ratios and phases do not.
    pub fn is_size(&self) -> bool {
        self.scale != Scale::One && self.lower <= 0.0 && self.default.is_none()
    }

    /// Whether it measures how much of the effect there is: a size, a share (a plain number from 0 on), or a ratio.
    pub fn measures(&self) -> bool {
        let share = self.scale == Scale::One && self.lower == 0.0 && self.default.is_none();
        self.is_size() || share || self.meaning == Meaning::Ratio
    }

    /// The value at which there is nothing of the effect.
    pub fn nothing(&self) -> f64 {
        if self.meaning == Meaning::Ratio { 1.0 } else { 0.0 }
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
    /// Torque over a power of the angle.
    TorquePerAngle(u8),
}

impl Scale {
    /// True if it holds a torque.
    pub fn is_torque(self) -> bool {
        matches!(self, Self::Torque | Self::Viscous | Self::Drag | Self::TorquePerAngle(_))
    }
}
