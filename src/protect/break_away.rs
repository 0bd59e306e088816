//! What holds this very shaft at rest: learned from its starts.
//!
//! Break-away friction of a shaft that nobody knows may be [`super::REST_MARGIN`] dead zones. Most shafts start far below that. What
//! a start took is noted whenever the voltage rises while the shaft stands, and the encoder then proves that it follows: the
//! highest voltage until the proof is enough, whatever held the shaft. A commissioning has four such starts or more, slow ones
//! ([`crate::commission`]). What is noted is the share of the dead zone that a start takes beyond it. It is one number for both directions, because
//! friction at rest exceeds friction in motion by about the same share in both. How much more the next start may take is a torque,
//! and so the same voltage in both directions: it is counted in mean dead zones, because the smaller one of the two would make it too small.
//!
//! Nothing is learned without a proof, so a shaft that is stuck or an encoder that is silent teaches nothing, and what is
//! learned never asks for more voltage than [`super::REST_MARGIN`].

use super::REST_MARGIN;
use super::expectation::Expectation;
use crate::units::{Voltage, mul_shift};

/// Fraction bits of a share.
const SHARE_BITS: u32 = 10;
/// One dead zone, Q10.
const ONE: i32 = 1 << SHARE_BITS;
/// By how much a start may take more than the hardest of the earlier ones, mean dead zones: a load step of 0.2, random torque, cogging
/// …
const SPREAD: f32 = 0.25;
/// … and ripple of the friction that holds: the more the higher that is, shares of the share.
const RIPPLE: f32 = 0.25;
/// What friction may take from a shaft that has started beyond what has held it, mean dead zones.
const MOVING_SPREAD: f32 = 0.05;
const SPREADS: [i32; 3] = [in_shares(SPREAD), in_shares(RIPPLE), in_shares(MOVING_SPREAD)];
/// Share beyond which nothing is learned: with the spread it is what a shaft needs that nobody knows.
const MOST: i32 = in_shares((REST_MARGIN - 1.0 - SPREAD) / (1.0 + RIPPLE));

/// Counts by which a shaft at an edge of the encoder flickers.
const FLICKER: i32 = 1;
/// Part of a lower share that one start teaches, as a shift: 1/16. The hardest of the last starts counts: friction varies from
/// place to place, and a hand or a load that helps does not decide.
const LOWER_SHIFT: u32 = 4;
/// Counts that a free shaft would have travelled in vain: friction held this one, and did not only let it start late.
const HELD_COUNTS: i32 = 8;
/// Counts of the sure model at which a proof comes late. The share then rises by half of the spread.
const LATE_COUNTS: i32 = 2;

/// Q10.
const fn in_shares(dead_zones: f32) -> i32 {
    (dead_zones * ONE as f32) as i32
}

/// What is known about the starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct State {
    /// Dead zones beyond the first that are enough to start, Q10.
    share: i32,
    /// Voltage that is enough to start in the direction of the drive. Computed while nothing drives.
    enough: Voltage,
    /// Voltage that friction may take from it once it has started.
    held: Voltage,
    /// The dead zones that both follow from, that of the direction first; `None`: something was learned since.
    followed: Option<(Voltage, Voltage)>,
    /// Highest voltage since it stood.
    peak: i32,
    /// Where the counter stands, and for how many looks in which nothing drove.
    place: i32,
    still: u16,
    /// It stood when the voltage rose.
    stood: bool,
}

impl Default for State {
    fn default() -> Self {
        Self {
            share: MOST,
            enough: Voltage(i32::MAX),
            held: Voltage(i32::MAX),
            followed: None,
            peak: 0,
            place: 0,
            still: 0,
            stood: false,
        }
    }
}

/// Dead zones beyond the first that a voltage has, Q10.
fn beyond(voltage: i32, dead_zone: Voltage) -> i32 {
    // Two nominal supplies at most, so that the shift stays within 31 bits.
    let more = voltage.saturating_sub(dead_zone.0).clamp(0, (1 << (30 - SHARE_BITS)) - 1);
    (more << SHARE_BITS).checked_div(dead_zone.0).unwrap_or(MOST)
}

impl State {
    /// A commissioning has seen it start: highest voltage and dead zone by direction. The harder of the two counts.
    #[cold]
    pub fn commissioned(&mut self, starts: [(Voltage, Voltage); 2]) {
        let [first, second] = starts.map(|(voltage, dead_zone)| beyond(voltage.0, dead_zone));
        (self.share, self.followed) = (first.max(second).min(MOST), None);
    }

    /// Begins anew here; what was learned stays.
    pub fn begin(&mut self, count: i32) {
        (self.peak, self.place, self.still, self.stood) = (0, count, 0, false);
    }

    /// A look at a shaft that stands with the bridge open.
    #[inline]
    pub fn stand(&mut self) {
        self.still = self.still.saturating_add(1);
    }

    /// A look in which nothing drives: for how long has the shaft stood?
    pub fn wait(&mut self, expectation: &Expectation, side: usize, count: i32) {
        self.still = self.still.saturating_add(1);
        if count.wrapping_sub(self.place).saturating_abs() > FLICKER {
            (self.place, self.still) = (count, 0);
        }
        (self.stood, self.peak) = (expectation.lasts(u32::from(self.still)), 0);
        self.follow(expectation, side);
    }

    /// This voltage has become current.
    pub fn rise(&mut self, voltage: i32) {
        self.peak = self.peak.max(voltage);
    }

    /// Has the shaft stood for a while before this voltage, and has no proof come since?
    pub fn stood(&self) -> bool {
        self.stood
    }

    /// Voltage that a shaft at rest needs at most.
    pub fn enough(&self, expectation: &Expectation, side: usize) -> Voltage {
        expectation.at_rest(self.enough, side)
    }

    /// Voltage that friction takes at most from a shaft that has just started: what held it, and no more than from one that turns.
    pub fn held(&self, expectation: &Expectation, side: usize) -> Voltage {
        expectation.starting(self.held, side)
    }

    /// Follows what was learned about starts and dead zones. Most looks have nothing to follow.
    #[inline]
    pub fn follow(&mut self, expectation: &Expectation, side: usize) {
        let followed = (expectation.dead_zone(side), expectation.dead_zone(side ^ 1));
        if self.followed != Some(followed) {
            self.followed = Some(followed);
            self.renew(followed);
        }
    }

    #[cold]
    #[inline(never)]
    fn renew(&mut self, (own, other): (Voltage, Voltage)) {
        let of = |voltage: i32, share| mul_shift(voltage, share, SHARE_BITS);
        let held = of(own.0, self.share.saturating_add(ONE));
        let mean = own.0.saturating_add(other.0) / 2;
        let [spread, ripple, moving] = SPREADS;
        let spread = spread.saturating_add(of(self.share, ripple));
        self.held = Voltage(held.saturating_add(of(mean, moving)));
        self.enough = Voltage(held.saturating_add(of(mean, spread)));
    }

    /// The encoder follows. Up to the proof the likely and the sure model have travelled so many counts.
    #[inline]
    pub fn learn(&mut self, expectation: &Expectation, side: usize, vain: [i32; 2]) {
        if self.stood || vain[1] >= LATE_COUNTS {
            self.note(expectation, side, vain);
        }
        self.stood = false;
    }

    /// One start. A function of its own: most proofs are those of a shaft that turns.
    #[cold]
    #[inline(never)]
    fn note(&mut self, expectation: &Expectation, side: usize, [likely, sure]: [i32; 2]) {
        let seen = beyond(self.peak, expectation.dead_zone(side));
        let [spread, ..] = SPREADS;
        let step = match seen.saturating_sub(self.share) {
            _ if sure >= LATE_COUNTS => spread / 2,
            higher @ 1.. if likely >= HELD_COUNTS => higher,
            1.. => 0,
            lower => lower >> LOWER_SHIFT,
        };
        (self.share, self.followed) = (self.share.saturating_add(step).min(MOST), None);
    }
}
