//! What the link knows of the axes, so that an order is prepared where it is made: all that it needs besides the state of its axis
//! is computed here, and the control tick puts constants in force by exchanging pointers.

use super::protocol::{Command, Refusal, Request};
use crate::axis::Axis;
use crate::axis::order::{Order, Origin};
use crate::axis::track_sine::Units;

/// The constants in force, one entry an axis; `None`: not configured. `P` points to them, and the control tick has the same pointer.
///
/// One order at a time: whoever makes the next one has noted the one before, if it was carried out ([`InForce::note`]).
#[derive(Clone, Debug)]
pub struct InForce<P, const AXES: usize> {
    axes: [Option<P>; AXES],
}

impl<P: AsRef<Axis> + Clone, const AXES: usize> InForce<P, AXES> {
    /// As the axes are at the start.
    pub const fn new(axes: [Option<P>; AXES]) -> Self {
        InForce { axes }
    }

    /// Makes an order. A bare configuration keeps what was chosen on the axis in force ([`Axis::keeping`]), and a sine is
    /// computed ahead. `supports` is asked about everything that would come into force, and `place` takes its constants.
    ///
    /// # Errors
    /// The command brings values that cannot be, or what `supports` and `place` say.
    pub fn prepare(
        &self,
        Request { axis, command }: &Request,
        supports: impl Fn(&Axis) -> Result<(), Refusal>,
        place: impl FnOnce(Axis) -> Result<P, Refusal>,
    ) -> Result<Order<P>, Refusal> {
        let in_force = self.axes.get(usize::from(*axis)).and_then(Option::as_ref).map(P::as_ref);
        let mut order = Order::built(command, |mut axis, origin| {
            supports(&axis)?;
            if let (Origin::Bare, Some(earlier)) = (origin, in_force) {
                axis = axis.keeping(earlier).map_err(Refusal::Parameters)?;
                supports(&axis)?;
            }
            place(axis)
        })?;
        if let Some(axis) = in_force {
            order.ahead(&Units::of(axis.scale()));
        }
        Ok(order)
    }

    /// Takes note of an order that was carried out.
    pub fn note(&mut self, axis: u8, order: &Order<P>) {
        let Some(in_force) = self.axes.get_mut(usize::from(axis)) else { return };
        match order {
            Order::Install(axis, _) => *in_force = Some(axis.clone()),
            Order::Run(Command::Reset) => *in_force = None,
            Order::Sine(_) | Order::Run(_) => {}
        }
    }
}
