//! Which effects of the library leave a trace in a steady state, and in which forms they are tried.

use super::rows::Rows;
use crate::gap::fit::hypothesis::{Freedom, Item};
use crate::system::effects::{Effect, Family, Forms, LIBRARY, Needs, Role};
use crate::system::model::{Kind, Model};
use crate::system::plant::physics::Drive;

/// Whether two effects describe the same place, so that one replaces the other. The damping of the base and a further one
/// that differs between the directions add up.
pub fn same_place(a: &Effect, b: &Effect) -> bool {
    a == b || (a.same_family(b) && a.family != Family::Viscous)
}

/// What the candidates are drawn from.
pub struct Offer<'a> {
    winding: bool,
    reversed: bool,
    fitted_to_log: bool,
    rectifiable: bool,
    taken: Vec<&'static Effect>,
    without: &'a [String],
}

impl<'a> Offer<'a> {
    /// The offer for a model and a table, but for these effects.
    pub fn new(model: &Model, Rows { volts, omega, .. }: &Rows, without: &'a [String]) -> Self {
        let winding = matches!(model.kind, Kind::DcMotor { .. });
        let negative = || volts.iter().zip(omega).filter(|(u, _)| **u < 0.0);
        Offer {
            winding,
            reversed: negative().next().is_some() && volts.iter().any(|u| *u > 0.0),
            fitted_to_log: model.fitted_to_log,
            rectifiable: omega.iter().all(|w| *w >= 0.0) && negative().any(|(_, w)| *w > 0.0),
            taken: model.known.iter().map(|k| k.effect).collect(),
            without,
        }
    }

    /// Every effect that could be named from this table.
    pub fn effects(&self) -> Vec<&'static Effect> {
        let library = LIBRARY.iter().copied();
        library.filter(|effect| self.allows(effect)).collect()
    }

    /// The forms that the search tries.
    pub fn forms(&self) -> Vec<Item> {
        self.in_role(Role::Representative)
    }

    /// The forms that are tried on top of a set.
    pub fn refinements(&self) -> Vec<Item> {
        self.in_role(Role::Refinement)
    }

    fn in_role(&self, role: Role) -> Vec<Item> {
        let effects = self.effects().into_iter();
        let chosen = effects.filter(|effect| effect.steady().is_some_and(|steady| steady.role == role));
        chosen.flat_map(forms).collect()
    }

    fn allows(&self, effect: &Effect) -> bool {
        effect.steady().is_some_and(|steady| self.holds(steady.needs))
            && !self.taken.iter().any(|taken| same_place(taken, effect))
            && !self.without.iter().any(|name| name == effect.name)
            && effect.fits(Drive::Voltage, self.winding, false)
            && !(self.fitted_to_log && effect.is_scale())
    }

    /// True if model and table hold what an effect needs to be seen.
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
pub fn forms(effect: &'static Effect) -> Vec<Item> {
    let optional = effect.parameters.iter().any(|p| p.default.is_some());
    match effect.steady().map(|steady| steady.forms) {
        Some(Forms::FromRest(values)) => vec![Item { effect, freedom: Freedom::Pinned(values) }],
        Some(Forms::Plain) => vec![Item::plain(effect)],
        _ if optional => vec![Item::plain(effect), Item::full(effect)],
        _ => vec![Item::full(effect)],
    }
}
