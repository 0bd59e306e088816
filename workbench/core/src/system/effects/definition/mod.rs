//! What an effect of the library has to say of itself.
//!
//! Every other module asks these fields, and none asks for a name: a new effect that fills them is known everywhere.

mod domain;
mod offered;
mod parameter;
mod relations;
mod starts;

pub use domain::Domain;
pub use offered::{Forms, InTables, Needs, Offered, Role, Shape, Steady};
pub use parameter::{Meaning, Parameter, Scale};
pub use relations::{Multiplies, Relations, Uneven};
pub use starts::{Signal, Starts};

use crate::system::plant::physics::{Drive, Physics};
use std::fmt;

/// One physical effect. It is a static of its own, and two references are equal if they are to the same static.
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
    /// Effects it is confused with.
    pub confusable_with: &'static [&'static Effect],
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
    /// Of which variable it is a curve, and where in it.
    pub domain: Domain,
    /// How much it claims beside the plain form of the same thing.
    pub form: Form,
    /// Which kinds of logs may name it, and what a table of settled speeds shows of it.
    pub offered: Offered,
    /// What ties it to other effects and to the numbers of the model.
    pub relations: Relations,
    /// True if the firmware has a number for it.
    pub on_chip: OnChip,
    /// Puts the parameters into the plant.
    pub apply: fn(&[f64], &mut Physics),
}

impl PartialEq for Effect {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Eq for Effect {}

impl fmt::Debug for Effect {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name)
    }
}

/// The axes on which an effect makes sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Every axis.
    Any,
    /// Only where a voltage drives a winding whose resistance and constant the model tells.
    Winding,
    /// The same, or where a first-order model tells how much of its damping is back-EMF: that tells the current's direction.
    BackEmf,
    /// Only where the current is known: behind such a winding, or because the input is a current or torque.
    Current,
    /// Only where the axis turns (no sine of a position on a linear axis).
    Rotary,
}

/// The place of the plant that an effect describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// A place of its own.
    Own,
    /// Dead zones of the input.
    DeadZone,
    /// Limits of the input.
    Limit,
    /// Friction that does not grow with speed.
    DryFriction,
    /// Friction in proportion to the speed.
    Viscous,
    /// What joins motor and load.
    Coupling,
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

/// What the firmware's compensator and loops can do with an effect or a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OnChip {
    /// It becomes part of a number on the chip, or the measured supply takes it up.
    Known,
    /// The firmware has no number for it.
    Unknown,
}

impl Effect {
    /// What most effects say beside what is their own: a field that an effect leaves out is as it stands here.
    pub const USUAL: Self = Self {
        name: "",
        summary: "",
        equation: "",
        source: "",
        signature: "",
        confusable_with: &[],
        separated_by: "",
        parameters: &[],
        starts: Starts::Grid(&[]),
        axis: Axis::Any,
        family: Family::Own,
        domain: Domain::Nowhere,
        form: Form::Plain,
        offered: Offered::Records(InTables::Counts),
        relations: Relations::NONE,
        on_chip: OnChip::Unknown,
        apply: |_, _| {},
    };

    /// Whether the effect is offered on such an axis. `winding`: the model tells what the winding does; a first-order
    /// model does not say how much of its damping is back-EMF, so nobody knows its current.
    pub fn fits(&self, drive: Drive, winding: bool, linear: bool) -> bool {
        match self.axis {
            Axis::Any => true,
            Axis::Winding | Axis::BackEmf => drive == Drive::Voltage && winding,
            Axis::Current => drive == Drive::Torque || winding,
            Axis::Rotary => !linear,
        }
    }

    /// True if two effects describe the same place, so that one replaces the other.
    pub fn same_family(&self, other: &Effect) -> bool {
        self == other || (self.family == other.family && self.family != Family::Own)
    }

    /// The place of the parameter that means this.
    pub fn place(&self, meaning: Meaning) -> Option<usize> {
        self.parameters.iter().position(|parameter| parameter.meaning == meaning)
    }

    /// The places of the parameters of the positive and of the negative side, of an effect with two sides.
    pub fn sides(&self) -> Option<(usize, usize)> {
        let side = |of: &str| self.parameters.iter().position(|parameter| parameter.name.starts_with(of));
        side("pos_").zip(side("neg_"))
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
        matches!(self.relations.multiplies, Some(Multiplies::Base { .. }))
    }

    /// True if it makes the measured speed late, or the drive.
    pub fn is_lag(&self) -> bool {
        *self == *super::RARE_LAG || super::LAGS.contains(&self)
    }

    /// True if it scales the whole steady-state curve: a base parameter, the gain of the drive or the scale of the sensor.
    pub fn is_scale(&self) -> bool {
        self.relations.multiplies.is_some()
    }
}
