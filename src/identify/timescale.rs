//! How slow is this motor? Answered during its first step, to a factor of two, before any regression.
//!
//! After a step from rest a first-order motor has travelled x(t) = v·(t − τ·(1 − e^(−t/τ))). The ratio x(t)/x(t/2) falls
//! from 4 (t ≪ τ) to 2 (t ≫ τ) whatever the final speed v, so neither gain nor dead zone is needed:
//!
//! | t/τ | 0.5 | 1 | 2 | 4 |
//! |---|---|---|---|---|
//! | x(t)/x(t/2) | 3.71 | 3.45 | 3.09 | 2.66 |
//!
//! A motor that still coasts backwards starts the clock where it turns. A winding's lag raises the ratio while t is short of it; the answer is then "slower than", which is true.

/// Displacement at half time below which the encoder's resolution spoils the ratio, counts.
const LEAST_COUNTS: i32 = 16;
/// First look, ticks.
const FIRST: u32 = 16;
/// Ratio in 1/1024 at t = 2τ.
const RATIO_AT_TWO: i64 = 3_160;
/// Ratio in 1/1024 at t = τ.
const RATIO_AT_ONE: i64 = 3_537;
/// Ratio in 1/1024 at t = τ/2.
const RATIO_AT_HALF: i64 = 3_799;

/// Looks at the displacement at t = 2ᵐ and 1.5·2ᵐ ticks.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// When the motion turned into the direction of the step, ticks after it.
    origin: u32,
    /// Displacement there, counts.
    lowest: i32,
    next: u32,
    after: u32,
    earlier: [i32; 2],
    /// The time constant is longer than this, ticks.
    pub at_least: u32,
    /// The time constant to a factor of two, ticks.
    pub found: Option<u32>,
}

impl Default for State {
    #[inline]
    fn default() -> Self {
        State {
            origin: 0,
            lowest: 0,
            next: FIRST,
            after: FIRST * 3 / 2,
            earlier: [0; 2],
            at_least: 0,
            found: None,
        }
    }
}

impl State {
    /// Notes the displacement in the direction of the step, `elapsed` ticks after it. `true`: something new is known, or what was known
    /// is not so.
    #[inline]
    pub fn note(&mut self, elapsed: u32, displacement: i32) -> bool {
        if displacement < self.lowest {
            let known = self.at_least > 0 || self.found.is_some();
            *self = State { origin: elapsed, lowest: displacement, ..State::default() };
            return known;
        }
        let elapsed = elapsed.wrapping_sub(self.origin);
        if elapsed != self.next || self.found.is_some() {
            return false;
        }
        let displacement = displacement.wrapping_sub(self.lowest);
        let [half_time, newer] = self.earlier;
        self.earlier = [newer, displacement];
        (self.next, self.after) = (self.after, self.next.saturating_mul(2));
        half_time >= LEAST_COUNTS && self.judge(elapsed, i64::from(displacement) * 1024, i64::from(half_time))
    }

    /// It was told otherwise, to a factor of two, ticks.
    pub fn is_about(&mut self, ticks: u32) {
        self.found = Some(ticks);
        self.at_least = self.at_least.max(ticks / 2);
    }

    #[inline]
    fn judge(&mut self, elapsed: u32, full: i64, half: i64) -> bool {
        let longer_than = |ratio: i64| full > ratio * half;
        if !longer_than(RATIO_AT_TWO) {
            self.found = Some(elapsed / 2);
            self.at_least = elapsed / 4;
            return true;
        }
        let bound = if longer_than(RATIO_AT_HALF) {
            elapsed.saturating_mul(2)
        } else if longer_than(RATIO_AT_ONE) {
            elapsed
        } else {
            elapsed / 2
        };
        self.at_least = self.at_least.max(bound);
        true
    }
}
