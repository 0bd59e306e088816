//! What is compensated beside what was identified: the load over the place at work (where its angle counts from, and whether it acts), what a model tells,
//! and whether the dead zone is at all.
//!
//! The counter starts anywhere at power-up, so a table acts only where its angle is known: one over the counter as it is, in the
//! session in which it came; one over the angle from the reference once that was found. A stored table waits for the reference.
//! Once counts may have been lost none acts. A constant without sines is the same everywhere, and always acts.

use super::{Axis, Mode, Refusal, State};
use crate::compensate::modelled::{Modelled, Told};
use crate::compensate::position_load::{PositionLoad, SHARE_BITS, Step};
use crate::control::Reference;
use crate::units::{Position, Voltage, VoltageQ14, mul_shift_within};

/// The load over the place, and what a model tells.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Load {
    /// What holds it here, now.
    pub(crate) voltage: Voltage,
    /// The same, as the identifier takes it.
    pub(crate) q14: VoltageQ14,
    acts: bool,
    /// Share of it that does not follow the shaft, Q15 ([`PositionLoad::rest`]).
    pub(super) rest: u16,
    /// Counter where that was computed.
    count: i32,
    /// Counter at the table's zero; `None`: not known.
    place: Option<i32>,
    step: Step,
    table: PositionLoad,
    /// What a model tells the compensator; `None`: nothing.
    pub(super) told: Option<Told>,
    /// Play of a gear that a move takes out of it, counts.
    pub(super) play: u16,
    /// All that a model tells, whether it acts or not.
    pub(super) modelled: Modelled,
}

impl Load {
    /// As at power-up. What means nothing without a table stays.
    pub(super) fn forget(&mut self) {
        let Self { voltage, q14, acts, rest, count: _, place, step: _, table, told, play, modelled } = self;
        (*voltage, *q14, *acts, *rest, *play) = Default::default();
        (*place, *told) = (None, None);
        (*table, *modelled) = Default::default();
    }

    /// Friction's share of a dead zone that is mostly something else, Q16.
    pub(super) fn friction_share(&self) -> u16 {
        self.told.map_or(0, |told| told.dry.share)
    }
}

impl Load {
    /// One tick: the voltage of the place where the counter is.
    #[inline]
    pub(super) fn watch(&mut self, count: i32) {
        if self.acts {
            self.follow(count);
        }
    }

    /// Nothing new where the shaft has not moved.
    #[cold]
    #[inline(never)]
    fn follow(&mut self, count: i32) {
        if count != self.count {
            self.settle(count);
        }
    }

    /// Is there a table, whether it acts or not?
    pub(super) fn is_given(&self) -> bool {
        self.table.period_counts() != 0
    }

    /// Is there a table that is to act, and may?
    fn is_chosen(&self) -> bool {
        self.table.is_on() && self.table.is_trusted()
    }

    /// Does it act now, and with which voltage here?
    fn settle(&mut self, count: i32) {
        self.count = count;
        (self.acts, self.voltage) = (false, Voltage::ZERO);
        if let Some(place) = self.zero()
            && self.is_chosen()
        {
            self.acts = true;
            self.voltage = self.step.voltage(&self.table, count.wrapping_sub(place));
        }
        self.q14 = self.voltage.q14();
    }

    /// What of a table that is too steep for the loops holds a shaft that should be at `aim`: a share of it follows the shaft, and the rest
    /// that place.
    fn mixed(&self, aim: Position) -> Voltage {
        if !self.acts {
            return Voltage::ZERO;
        }
        // A constant has no slope, and so no need of this.
        let there = self.step.voltage(&self.table, aim.count().wrapping_sub(self.place.unwrap_or(0)));
        self.voltage.plus(Voltage(mul_shift_within(
            there.minus(self.voltage).0,
            self.rest.into(),
            SHARE_BITS,
        )))
    }

    /// Is there one that is to act, may, and does not?
    pub(super) fn waits(&self) -> bool {
        !self.acts && self.is_chosen()
    }

    /// This table from now on, whose zero is at this place, if it is known. Call [`Load::renew`] after it.
    pub(super) fn take(&mut self, table: &PositionLoad, place: Option<i32>, count: i32) {
        (self.table, self.place, self.count) = (*table, place, count);
    }

    /// Where its zero is; anywhere for a constant alone.
    fn zero(&self) -> Option<i32> {
        if self.table.is_constant() { Some(0) } else { self.place }
    }

    /// Beside these loops.
    #[inline(never)]
    pub(super) fn renew(&mut self, per_count: f32) {
        self.step = self.table.step();
        self.rest = self.table.rest(per_count);
        self.settle(self.count);
    }

    /// The reference was found.
    pub(super) fn refer_to(&mut self, datum: i32) {
        if self.table.is_absolute() {
            self.found(Some(datum));
        }
    }

    /// The table's zero is there from now on; `None`: counts may have been lost.
    pub(super) fn found(&mut self, place: Option<i32>) {
        self.place = place;
        self.settle(self.count);
    }

    /// The table as another session can use it: from the reference, if that is known.
    #[inline(never)]
    pub(super) fn told(&self, datum: Option<i32>) -> PositionLoad {
        match self.place.zip(datum) {
            Some((place, datum)) if !self.table.is_absolute() && !self.table.is_constant() => {
                self.table.moved(self.step, datum.wrapping_sub(place)).absolute(true)
            }
            _ => self.table,
        }
    }
}

impl State {
    /// What of the table is added while some of it does not follow the shaft: where there is no place to be at, all of it does.
    #[cold]
    #[inline(never)]
    pub(super) fn steep_load(&self) -> Voltage {
        if matches!(self.mode, Mode::Drive(_)) {
            return self.load.voltage;
        }
        self.load.mixed(self.reference.position)
    }
}

impl Axis {
    /// At any time.
    pub(super) fn compensation(&self, state: &mut State, on: bool) -> Result<(), Refusal> {
        state.compensation = on;
        Ok(())
    }

    /// While nothing runs: set-points do not jump.
    pub(super) fn modelled(&self, state: &mut State, modelled: Modelled) -> Result<(), Refusal> {
        self.idle(state)?;
        state.take(modelled);
        Ok(())
    }

    /// In any mode but those that excite: the integrator gives what the table takes over.
    #[inline(never)]
    pub(super) fn position_load(&self, state: &mut State, load: &PositionLoad) -> Result<(), Refusal> {
        self.unexcited(state)?;
        let per_count = state.design.loops.per_count();
        load.check().map_err(Refusal::Value)?;
        let before = state.load.voltage;
        state.load.take(load, if load.is_absolute() { state.datum } else { Some(0) }, state.count);
        state.load.renew(per_count);
        state.control.shift(before.minus(state.load.voltage));
        Ok(())
    }

    /// How far beyond its target a move that goes down turns, counts. Where the end stop is nearer than that, it does not.
    pub(super) fn back(&self, state: &State, target: i32, start: &Reference) -> i32 {
        let play = i32::from(state.load.play);
        let down = target.wrapping_sub(start.position.count()) < 0 && state.compensation;
        let fits = down && self.within_travel(state, target.wrapping_sub(play), 0.0).is_ok();
        if fits { play } else { 0 }
    }
}
