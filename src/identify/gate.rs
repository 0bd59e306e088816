//! Which windows may be used: a condition must have held in every hop that the window spans.
//!
//! Each condition is a run length: the number of hops in a row that satisfied it, kept as the last hop that did not. No
//! window is searched.

use super::spline::{HOPS_PER_BLOCK, HOPS_PER_WINDOW, Hop};
use crate::units::Direction;

/// Highest voltage of the linear range, Q14: below the lowest saturation that is supported without the second set.
pub const LINEAR_LIMIT: i32 = 10_813; // 0.66
/// Highest voltage of the core set, Q14; a saturation between this and [`LINEAR_LIMIT`] is found by comparing slopes.
pub const CORE_LIMIT: i32 = 8_520; // 0.52
/// Least counts per block of a moving motor: below, one count of quantisation is half the motion.
const COUNTS_PER_BLOCK: i32 = 2;

/// The last hop that did not satisfy a condition, by its number. The number wraps; a run of 2¹⁶ hops then counts as new.
#[derive(Clone, Copy, Debug, Default)]
struct Run(u16);

impl Run {
    #[inline(always)]
    fn note(&mut self, now: u16, holds: bool) {
        if !holds {
            self.0 = now;
        }
    }

    #[inline]
    fn spans(self, now: u16, hops: u32) -> bool {
        u32::from(now.wrapping_sub(self.0)) >= hops
    }
}

/// Run lengths of one direction.
#[derive(Clone, Copy, Debug, Default)]
struct Side {
    moving: Run,
    driven: Run,
    linear: Run,
    core: Run,
    high: Run,
}

/// Run lengths of all conditions.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    positions: [i32; HOPS_PER_BLOCK as usize],
    /// Hops noted, wraps.
    now: u16,
    directions: [Side; 2],
    still: Run,
}

impl State {
    /// Notes what the hop that just ended satisfied. `break_away`: least voltage that counts as driving, Q14.
    #[inline]
    pub fn note(&mut self, hop: &Hop, break_away: i32) {
        self.now = self.now.wrapping_add(1);
        let now = self.now;
        let moved = hop.position.wrapping_sub(self.exchange(hop.position));
        for (direction, sign) in self.directions.iter_mut().zip([1, -1]) {
            let (low, high) = if sign > 0 {
                (hop.lowest, hop.highest)
            } else {
                (hop.highest.wrapping_neg(), hop.lowest.wrapping_neg())
            };
            direction.moving.note(now, moved.wrapping_mul(sign) >= COUNTS_PER_BLOCK);
            direction.driven.note(now, low > break_away);
            direction.linear.note(now, high < LINEAR_LIMIT);
            direction.core.note(now, high < CORE_LIMIT);
            direction.high.note(now, low > LINEAR_LIMIT);
        }
        self.still.note(now, hop.lowest == 0 && hop.highest == 0);
    }

    #[inline]
    fn exchange(&mut self, position: i32) -> i32 {
        match self.positions.get_mut(usize::from(self.now) % HOPS_PER_BLOCK as usize) {
            Some(slot) => core::mem::replace(slot, position),
            None => position,
        }
    }

    /// The motor moved in this direction all the time.
    #[inline]
    pub fn moving(&self, direction: Direction) -> bool {
        // The first block's own start is not a hop of the window: 16 − 3 overlapping blocks.
        self.get(direction).moving.spans(self.now, HOPS_PER_WINDOW - HOPS_PER_BLOCK + 1)
    }

    /// The voltage drove in this direction all the time.
    #[inline]
    pub fn driven(&self, direction: Direction) -> bool {
        self.get(direction).driven.spans(self.now, HOPS_PER_WINDOW)
    }

    /// The voltage stayed in the linear range all the time.
    #[inline]
    pub fn linear(&self, direction: Direction) -> bool {
        self.get(direction).linear.spans(self.now, HOPS_PER_WINDOW)
    }

    /// The voltage stayed in the core of the linear range all the time.
    #[inline]
    pub fn core(&self, direction: Direction) -> bool {
        self.get(direction).core.spans(self.now, HOPS_PER_WINDOW)
    }

    /// The voltage was above the linear range all the time.
    #[inline]
    pub fn high(&self, direction: Direction) -> bool {
        self.get(direction).high.spans(self.now, HOPS_PER_WINDOW)
    }

    /// The terminals had 0 V all the time.
    #[inline]
    pub fn still(&self) -> bool {
        self.still.spans(self.now, HOPS_PER_WINDOW)
    }

    /// Forgets the past (after a change of lengths).
    #[inline]
    pub fn restart(&mut self) {
        *self = State::default();
    }

    #[inline]
    fn get(&self, direction: Direction) -> Side {
        self.directions[direction]
    }
}
