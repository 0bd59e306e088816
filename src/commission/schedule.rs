//! How long each part lasts and with which blocks it is averaged.

use super::excite::SLOW_BREAK_AWAY;
use super::{Params, State};
use crate::identify::regression::Sums;
use crate::identify::slices::{LEARN_SLICES, NO_SLICES};
use crate::identify::spline::Lengths;
use crate::units::Direction;

/// Length of the second part of the verification, in 1/256 of the time after the ramps, for each direction.
const VERIFY_LOW: u32 = 18;

impl Params {
    /// The ramp overshoots on a motor whose time constant it does not know to be short.
    #[inline]
    pub(super) fn break_away_level(&self, state: &State, direction: Direction) -> i32 {
        let level = state.break_away[direction];
        if state.timescale.found.is_some() { level } else { level.min(SLOW_BREAK_AWAY) }
    }

    /// What saturation and coasting leave, shared by the strokes. Reckoned once: what it follows from changes when learning begins
    /// and when the time constant shows.
    #[inline]
    pub(super) fn learn_ticks(&self, state: &mut State) -> u32 {
        match state.stroke_ticks {
            Some(ticks) => ticks,
            None => self.learn_ticks_anew(state),
        }
    }

    #[cold]
    #[inline(never)]
    fn learn_ticks_anew(&self, state: &mut State) -> u32 {
        let strokes = u32::from(self.strokes(state));
        let stroke = self.coast_ticks(state) + self.start_ticks(state);
        let others = 2 * (self.saturate_ticks(state) + self.verify_ticks(state)) + strokes * stroke;
        *state.stroke_ticks.insert(state.remaining.saturating_sub(others) / strokes)
    }

    /// One stroke a direction; two when the budget holds many time constants.
    #[inline]
    pub(super) fn strokes(&self, state: &State) -> u8 {
        if self.budget / 32 > state.timescale.at_least.max(self.scale.config.tick_hz / 4) { 4 } else { 2 }
    }

    #[inline]
    pub(super) fn saturate_ticks(&self, state: &State) -> u32 {
        let block = self.identify.block_ticks(&state.learn_lengths);
        ((state.remaining >> 8) * 21).max(6 * block)
    }

    /// The first part of the verification, at half voltage.
    #[inline]
    pub(super) fn verify_middle_ticks(&self, state: &State) -> u32 {
        let block = self.identify.block_ticks(&state.learn_lengths);
        ((state.remaining >> 8) * 9).max(5 * block + block / 2)
    }

    /// The whole verification; the second part drives at low voltage, where the dead zone shows.
    #[inline]
    pub(super) fn verify_ticks(&self, state: &State) -> u32 {
        let middle = self.verify_middle_ticks(state);
        match state.timescale.found {
            Some(_) => middle + (state.remaining >> 8) * VERIFY_LOW,
            None => middle,
        }
    }

    #[inline]
    pub(super) fn coast_ticks(&self, state: &State) -> u32 {
        6 * self.identify.block_ticks(&self.coast_lengths(state))
    }

    /// A slower motor wants longer blocks; what was learned with the shorter ones does not fit and goes.
    #[cold]
    #[inline(never)]
    pub(super) fn choose_block(&self, state: &mut State) {
        let lengths = self.identify.lengths_for(state.timescale.at_least);
        if lengths.block > state.learn_lengths.block {
            state.learn_lengths = lengths;
            state.identify.relength(lengths);
            state.identify.forget();
            state.outer = [Sums::default(); 2];
            state.slices = NO_SLICES;
        }
    }

    /// Blocks for coasting: four of them within 0.7 time constants.
    #[inline]
    pub(super) fn coast_lengths(&self, state: &State) -> Lengths {
        let mut lengths = state.learn_lengths;
        let time_constant = state.timescale.found.unwrap_or(state.timescale.at_least);
        while lengths.block > 2
            && lengths.counts > 0
            && self.identify.block_ticks(&lengths) > time_constant / 6
        {
            lengths.block -= 1;
            lengths.counts -= 1;
        }
        lengths
    }

    /// All strokes together fill all slices.
    #[inline]
    pub(super) fn slice(&self, state: &mut State) -> usize {
        let each = LEARN_SLICES as u32 / u32::from(self.strokes(state));
        let within = (state.elapsed * each / self.learn_ticks(state).max(1)).min(each - 1);
        let slice = (u32::from(state.stroke) * each + within) as usize % LEARN_SLICES;
        // A slice holds rows of one direction: two that follow share their time where the motor shuttles.
        if state.shuttle.turned { slice & !1 | state.direction as usize } else { slice }
    }
}
