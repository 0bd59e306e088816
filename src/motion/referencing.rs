//! Where zero is: "here is x", an end stop, or the index pulse of the encoder.
//!
//! An encoder that counts knows how far, not where. Until an axis is referenced its travel limits count from power-up,
//! and absolute targets are refused. A search drives slowly in one direction with a voltage that is bounded: what the
//! speed takes, twice, and a little more, so that a stop is leaned on and not rammed.
//!
//! An end stop is found when the shaft has followed and then stands although it is pushed: by the model (the loops ask
//! for all that the bound allows), or by the current. That a shaft which never moved proves nothing is why a search
//! that starts at the stop, or with the encoder unplugged, ends without a reference.

use crate::units::Voltage;
use serde::{Deserialize, Serialize};

/// How to find zero. Positions are those of the controlled shaft; the sign of a speed is the direction of the search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Referencing {
    /// The shaft stands at this position.
    Here {
        /// rad.
        position_rad: f32,
    },
    /// Drive until an end stop holds the shaft; it is at this position.
    EndStop {
        /// rad/s.
        speed_rad_s: f32,
        /// rad.
        position_rad: f32,
        /// Give up after this way, rad.
        reach_rad: f32,
        /// Current of a shaft that is held, A; `None`: the model alone decides.
        current_a: Option<f32>,
    },
    /// Drive until the index pulse; it is at this position. The index is read once a tick, so the speed must stay below
    /// one count a tick.
    Index {
        /// rad/s.
        speed_rad_s: f32,
        /// rad.
        position_rad: f32,
        /// Give up after this way, rad.
        reach_rad: f32,
    },
}

/// Counts in the direction of the search that prove that shaft and encoder follow.
const PROOF_COUNTS: i32 = 8;
/// A shaft that has not moved for so many times the patience will not move any more.
const GIVE_UP: u32 = 10;

/// What ends a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mark {
    /// A stop; the raw current above which the shaft is held.
    EndStop { current: Option<u16> },
    /// The index pulse.
    Index,
}

/// A search, in machine units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Search {
    pub(crate) mark: Mark,
    /// +1 or −1.
    pub(crate) direction: i32,
    /// Counter where it began.
    pub(crate) start: i32,
    /// Longest way, counts.
    pub(crate) reach: i32,
    /// What the mark is to be called, counts.
    pub(crate) position: i32,
    /// Largest voltage behind the dead zone.
    pub(crate) push: Voltage,
    /// Ticks without motion after which a pushed shaft is held.
    pub(crate) patience: u32,
    /// Farthest count in the direction of the search.
    pub(crate) farthest: i32,
    /// Ticks since.
    pub(crate) still: u32,
}

/// What a search sees in a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) count: i32,
    /// Raw current; `None`: not sensed.
    pub(crate) current: Option<i16>,
    /// The index pulse is there.
    pub(crate) index: bool,
    /// The loops asked for more than the bound in the last tick.
    pub(crate) pushing: bool,
}

/// How a search stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Finding {
    Searching,
    /// The mark is at this count.
    Found(i32),
    Missed,
}

impl Search {
    /// One tick.
    pub(crate) fn step(&mut self, sight: &Sight) -> Finding {
        let ahead = sight.count.wrapping_sub(self.farthest);
        if ahead.signum() == self.direction {
            self.farthest = sight.count;
            self.still = 0;
        } else {
            self.still = self.still.saturating_add(1);
        }
        if self.mark == Mark::Index && sight.index {
            return Finding::Found(sight.count);
        }
        if self.way() > self.reach || self.still >= self.patience.saturating_mul(GIVE_UP) {
            return Finding::Missed;
        }
        if self.held(sight) {
            return Finding::Found(sight.count);
        }
        Finding::Searching
    }

    /// Is the shaft expected to stand still under voltage? Then a missing motion is no fault.
    pub(crate) fn leans(&self) -> bool {
        matches!(self.mark, Mark::EndStop { .. }) && self.way() >= PROOF_COUNTS
    }

    /// The voltage within the bound, and whether it was beyond.
    pub(crate) fn bound(&self, wanted: Voltage) -> (Voltage, bool) {
        let bounded = wanted.min(self.push).max(Voltage::ZERO.minus(self.push));
        (bounded, bounded != wanted)
    }

    fn held(&self, sight: &Sight) -> bool {
        let Mark::EndStop { current } = self.mark else {
            return false;
        };
        let heavy = match (current, sight.current) {
            (Some(limit), Some(current)) => current.unsigned_abs() > limit,
            _ => false,
        };
        self.way() >= PROOF_COUNTS && self.still >= self.patience && (sight.pushing || heavy)
    }

    /// Way made in the direction of the search, counts.
    fn way(&self) -> i32 {
        self.farthest.wrapping_sub(self.start).saturating_mul(self.direction)
    }
}
