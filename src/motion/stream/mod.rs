//! Streamed set-points: the host sends points ahead of time, each with position, speed and the time since the one
//! before (the field's *PVT* or interpolated position mode); the chip moves along a polynomial from point to point.
//!
//! ```text
//! points → queue → segment: position, speed, acceleration of this tick → governor: limits → loops
//! ```
//!
//! A point without acceleration is reached along a cubic (position and speed without a jump), one with acceleration along
//! a quintic. What the points ask for beyond the limits is followed as fast as these allow and caught up with
//! (`stream::governor`). A stream ends when no further point is there: at the last point if it rests there, otherwise it has
//! *run dry*, and the axis slows down to rest within its limits and tells so.

mod governor;
mod segment;

use crate::control::Reference;
use crate::motion::trajectory::Limits;
use crate::record::Limit;
use crate::units::Position;
use governor::Governor;
use segment::Segment;
pub(crate) use segment::{Knot, Plan};
use serde::{Deserialize, Serialize};

/// A point of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Position, rad relative to the position at power-up.
    pub position_rad: f32,
    /// Speed there, rad/s.
    pub speed_rad_s: f32,
    /// Acceleration there, rad/s², if it is known.
    pub acceleration_rad_s2: Option<f32>,
    /// Control ticks from the point before, or from now if there is none. 4 … 1,000,000.
    pub ticks: u32,
}

impl Point {
    /// Points that wait, beside the one that is under way to.
    pub const ROOM: usize = 4;
    /// Fewest ticks between two points.
    pub const FEWEST_TICKS: u32 = 4;
    /// Most ticks between two points.
    pub const MOST_TICKS: u32 = 1_000_000;
}

/// A stream under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stream {
    segment: Segment,
    queue: [Knot; Point::ROOM],
    waiting: usize,
    governor: Governor,
}

/// What a tick of a stream brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Step {
    pub reference: Reference,
    /// What keeps the set-point from what was streamed.
    pub limit: Limit,
    pub state: Flow,
}

/// How a stream goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Flow {
    On,
    /// At rest at the last point.
    Arrived(Position),
    /// No further point, and the set-point moves.
    Dry,
}

impl Stream {
    /// From where the set-point is now along the first plan. `stops`: where the travel ends, if it does.
    pub fn begin(start: &Reference, first: &Plan, limits: &Limits, stops: Option<[Position; 2]>) -> Self {
        let mut segment = Segment::of(first);
        if !start.rests() {
            // That place was the last tick's.
            segment.step();
        }
        Self {
            segment,
            queue: [Knot::default(); Point::ROOM],
            waiting: 0,
            governor: Governor::new(start, limits, stops),
        }
    }

    /// Where the last point that has arrived will have brought it.
    pub fn tail(&self) -> &Knot {
        match self.waiting.checked_sub(1).and_then(|last| self.queue.get(last)) {
            Some(last) => last,
            None => self.segment.end(),
        }
    }

    /// One more point. False: there is no room.
    pub fn push(&mut self, knot: Knot) -> bool {
        match self.queue.get_mut(self.waiting) {
            Some(place) => {
                *place = knot;
                self.waiting = self.waiting.wrapping_add(1);
                true
            }
            None => false,
        }
    }

    /// The set-point of this tick.
    pub fn step(&mut self) -> Step {
        if self.segment.done() {
            self.next();
        }
        let ended = self.segment.done();
        let wanted = self.segment.step();
        let (reference, limit) = self.governor.step(&wanted);
        let state = match ended {
            false => Flow::On,
            true if !wanted.rests() => Flow::Dry,
            // What lags behind arrives first.
            true if reference != wanted => Flow::On,
            true => Flow::Arrived(wanted.position),
        };
        Step { reference, limit, state }
    }

    /// On to the next point, if there is one. Out of the tick's stack frame, like all that is rare.
    #[inline(never)]
    fn next(&mut self) {
        let Some(left) = self.waiting.checked_sub(1) else {
            return;
        };
        let [knot, others @ ..] = self.queue;
        // It was planned when it arrived, so it can be.
        if let Some(plan) = Plan::new(self.segment.end(), &knot) {
            self.segment = Segment::of(&plan);
        }
        for (place, other) in self.queue.iter_mut().zip(others) {
            *place = other;
        }
        self.waiting = left;
    }
}
