//! Further starts: what holds the shaft differs from place to place, and both ramps of the break-away begin at about the same one.
//!
//! Behind every coasting the shaft stands where it happens to. A short ramp starts it there before the commissioning goes on: from a
//! voltage below the lowest of the earlier starts to one that is far above the highest. What it finds is for protection
//! ([`crate::protect`]); the identification rests on the first two.

use super::breakaway::MOST_BREAK_AWAY;
use super::{Input, Params, Phase, State};

/// A ramp begins at this share of the lowest start, in quarters, and gives up at that of the highest.
const FROM_QUARTERS: i32 = 3;
const UP_TO_QUARTERS: i32 = 6;
/// Length of a ramp that is reckoned with, share of the first ones as a shift: a quarter, which starts at a quarter of the supply take.
const LENGTH_SHIFT: u32 = 2;

impl Params {
    /// What comes next, behind a further start where there is to be one: not of an axis that moves by itself or so slowly that it
    /// coasts for long, nor where the travel between end stops is short.
    pub(super) fn start_before(&self, state: &mut State, next: Phase, count: i32) {
        let starts = self.start_ticks(state) > 0 && !state.shuttle.turned;
        state.after_start = starts.then_some(next);
        state.enter(if starts { Phase::Settle } else { next }, count);
    }

    /// Ticks that are kept free for one of them.
    pub(super) fn start_ticks(&self, state: &State) -> u32 {
        match state.timescale.found {
            Some(_) if !state.restless => self.settle_ticks() + (self.ramp_ticks() >> LENGTH_SHIFT),
            _ => 0,
        }
    }

    /// One tick: rest, then the ramp.
    #[cold]
    #[inline(never)]
    pub(super) fn start(&self, state: &mut State, input: &Input) {
        let [low, high] = [state.started[0].min(state.started[1]), state.started[0].max(state.started[1])];
        if state.phase == Phase::Settle {
            if self.stands(state) {
                state.enter(Phase::BreakAway, input.count);
                state.elapsed = self.ramp_ticks_to(low / 4 * FROM_QUARTERS);
            }
            return;
        }
        let displacement = state.displacement(input.count);
        self.raise(state, input, self.ramp_ticks(), displacement);
        let moves = state.ramp.moved(displacement);
        if moves {
            let started = &mut state.started[state.direction];
            *started = state.ramp.started(state.ramp.level).max(*started);
            state.note_least_start();
        }
        let given_up = state.level >= (high / 4 * UP_TO_QUARTERS).min(MOST_BREAK_AWAY);
        if let Some(next) = state.after_start
            && (moves || given_up)
        {
            state.after_start = None;
            state.enter(next, input.count);
        }
    }
}
