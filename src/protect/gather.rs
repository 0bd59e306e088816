//! What happens between two looks: sums of voltage and current, and the one thing that a mean would hide.
//!
//! Faults of a motor take milliseconds. Protection therefore looks at an axis 2,500 to 5,000 times a second
//! (see [`super::looks`]) and not in every tick: what lies between is gathered here, a few additions a tick. Counts that jump are seen in
//! the very tick, because over several of them a jump would hide in a motion.
//!
//! A jump shows as a speed that no shaft takes from one tick to the next. One beyond all speeds is a fault at once; one that an end stop or
//! a tick that was missed may explain is one if it does not remain alone.

use super::expectation::Expectation;
use super::looks::look_bits;
use crate::config::Scale;
use crate::units::Voltage;

/// Looks for which a change of speed counts that no shaft makes, and how many of them are no fault yet. A reading that is wrong once makes
/// three, an end stop one or two.
const BEND_LOOKS: u32 = 128;
const MOST_BENDS: u32 = 6;

/// What a tick brings.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// Raw counter.
    pub count: i32,
    /// Raw current; `None`: not sensed.
    pub current: Option<i16>,
    /// Terminal voltage that acted since the last tick; `None`: bridge open.
    pub voltage: Option<Voltage>,
}

/// What lay between two looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Averages {
    /// Mean terminal voltage; `None`: the bridge was open, at least in one tick.
    pub voltage: Option<Voltage>,
    /// Sum of the current over the ticks, converter counts; 0 where it was not sensed.
    pub current: i32,
}

/// Sums since the last look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    /// Q20.
    voltage: i32,
    current: i32,
    open: bool,
    ticks: u32,
    count: Option<i32>,
    /// Counts of the last tick.
    moved: i32,
    /// Looks for which the changes of speed count that no shaft makes.
    bends: u32,
}

/// How many ticks a look takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Params {
    /// Ticks between two looks, as a shift.
    bits: u32,
}

/// What a tick asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Due {
    Nothing,
    Look,
    /// The speed has changed as that of no shaft does.
    Bend,
}

impl State {
    /// Averages of what was gathered; the next tick begins anew.
    #[inline]
    pub fn take(&mut self, bits: u32) -> Averages {
        let averages = Averages {
            voltage: (!self.open).then_some(Voltage(self.voltage >> (bits & 31))),
            current: self.current,
        };
        let bends = self.bends.saturating_sub(1);
        *self = Self { count: self.count, moved: self.moved, bends, ..Self::default() };
        averages
    }

    /// Is it one too many, or more than any speed explains?
    #[cold]
    #[inline(never)]
    pub fn jumps(&mut self, expectation: &Expectation) -> bool {
        self.bends = self.bends.saturating_add(BEND_LOOKS);
        self.moved.saturating_abs() > expectation.jump() || self.bends > MOST_BENDS * BEND_LOOKS
    }
}

impl Params {
    pub fn new(scale: &Scale) -> Self {
        Self { bits: look_bits(scale) }
    }

    #[inline]
    pub fn bits(&self) -> u32 {
        self.bits
    }

    /// Is this tick the first one that is gathered, or the only one?
    #[inline]
    pub fn is_behind(&self, state: &State) -> bool {
        state.ticks == 1 || self.bits == 0
    }

    /// Ticks from the next one, which counts as one, to a later one behind a look.
    pub fn ticks_behind_look(&self, state: &State) -> u32 {
        let most = (1u32 << (self.bits & 31)).wrapping_sub(1);
        (!state.ticks & most).wrapping_add(2)
    }

    /// Does the next tick end what is gathered?
    pub fn is_due(&self, state: &State) -> bool {
        state.ticks.wrapping_add(1) >> (self.bits & 31) != 0
    }

    /// One tick with the bridge open and the shaft at rest: nothing is summed up.
    #[inline]
    pub fn rest(&self, state: &mut State, count: i32) -> Due {
        state.open = true;
        state.count = Some(count);
        state.moved = 0;
        state.ticks = state.ticks.wrapping_add(1);
        if state.ticks >> (self.bits & 31) != 0 { Due::Look } else { Due::Nothing }
    }

    /// One tick.
    #[inline]
    pub fn step(&self, state: &mut State, expectation: &Expectation, reading: &Reading) -> Due {
        match reading.voltage {
            Some(voltage) => state.voltage = state.voltage.saturating_add(voltage.0),
            None => state.open = true,
        }
        state.current = state.current.saturating_add(i32::from(reading.current.unwrap_or(0)));
        state.ticks = state.ticks.wrapping_add(1);
        let before = state.count.replace(reading.count).unwrap_or(reading.count);
        let moved = reading.count.wrapping_sub(before);
        let bend = moved.wrapping_sub(core::mem::replace(&mut state.moved, moved));
        if bend.unsigned_abs() > expectation.bend() && reading.voltage.is_some() {
            Due::Bend
        } else if state.ticks >> (self.bits & 31) != 0 {
            Due::Look
        } else {
            Due::Nothing
        }
    }
}
