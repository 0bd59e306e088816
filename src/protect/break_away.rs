//! What holds this very shaft at rest: learned from its starts.
//!
//! Break-away friction of a shaft that nobody knows may be [`super::REST_MARGIN`] dead zones. Most shafts start far below that. How
//! much more than the dead zone it took is noted whenever the voltage rises while the shaft stands, and the encoder then
//! proves that it follows: the highest voltage until the proof is enough, whatever held it. A commissioning begins
//! with such starts, slow ones. What is noted is the excess over the dead zone: a load shifts both alike.
//!
//! Nothing is learned without a proof, so a shaft that is stuck or an encoder that is silent teaches nothing, and what is
//! learned never asks for more voltage than [`super::REST_MARGIN`].

use super::expectation::Expectation;
use crate::units::Voltage;

/// Counts by which a shaft at an edge of the encoder flickers.
const FLICKER: i32 = 1;
/// Share of a lower level that one start teaches, as a shift: 1/8. A hand that helps does not decide.
const LOWER_SHIFT: u32 = 3;
/// The same of a higher one: half. Loads come and go, and the highest of them counts.
const RAISE_SHIFT: u32 = 1;
/// Counts that a free shaft would have travelled in vain: friction held this one, and did not only let it start late.
const HELD_COUNTS: i32 = 8;
/// Counts of the sure model at which a proof comes late, and share of the spread by which the level rises then, as a shift.
const LATE_COUNTS: i32 = 2;
const LATE_SHIFT: u32 = 1;

/// A start that was not yet seen, as an excess.
const UNSEEN: i32 = i32::MAX;

/// What is known about the starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct State {
    /// Voltage beyond the dead zone that is enough to start, by direction, or [`UNSEEN`].
    excess: [i32; 2],
    /// Highest voltage since it stood.
    peak: i32,
    /// Where the counter stands, and for how many looks.
    place: i32,
    still: u16,
    /// It stood when the voltage rose.
    stood: bool,
}

impl Default for State {
    fn default() -> Self {
        Self { excess: [UNSEEN; 2], peak: 0, place: 0, still: 0, stood: false }
    }
}

impl State {
    /// A commissioning has seen it start with so much more than the dead zone.
    pub fn commissioned(&mut self, excess: [Voltage; 2]) {
        self.excess = excess.map(|excess| excess.0.max(0));
    }

    /// Begins anew; what was learned stays.
    pub fn begin(&mut self) {
        *self = Self { excess: self.excess, ..Self::default() };
    }

    /// One look, for how long the shaft has stood.
    pub fn watch(&mut self, count: i32) {
        self.still = self.still.saturating_add(1);
        if count.wrapping_sub(self.place).saturating_abs() > FLICKER {
            (self.place, self.still) = (count, 0);
        }
    }

    /// Nothing drives yet.
    pub fn wait(&mut self, expectation: &Expectation) {
        (self.stood, self.peak) = (expectation.lasts(u32::from(self.still)), 0);
    }

    /// This voltage has become current.
    pub fn rise(&mut self, voltage: i32) {
        self.peak = self.peak.max(voltage);
    }

    /// Voltage that a shaft at rest needs at most, and then while it gets under way.
    pub fn margins(&self, expectation: &Expectation, side: usize) -> [Voltage; 2] {
        let side = side & 1;
        let rest = expectation.rest_beyond(self.excess[side], side);
        [rest, expectation.starting(rest, side)]
    }

    /// The encoder follows. Up to the proof the likely and the sure model have travelled so many counts.
    pub fn learn(&mut self, expectation: &Expectation, side: usize, [likely, sure]: [i32; 2]) {
        let side = side & 1;
        let most = expectation.most_excess(side);
        let known = self.excess[side].min(most);
        let seen = self.peak.saturating_sub(expectation.width[side].0).max(0);
        let step = match seen.saturating_sub(known) {
            _ if sure >= LATE_COUNTS => expectation.spread(side) >> LATE_SHIFT,
            _ if !self.stood => 0,
            higher @ 1.. if likely >= HELD_COUNTS => higher >> RAISE_SHIFT,
            1.. => 0,
            lower => lower >> LOWER_SHIFT,
        };
        if self.stood || sure >= LATE_COUNTS {
            self.excess[side] = known.saturating_add(step).min(most);
        }
        self.stood = false;
    }
}
