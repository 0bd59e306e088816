//! The winding's resistance of this very moment: what a shaft shows that stands.
//!
//! ```text
//! R = (∫v dt − L·Δi) / ∫i dt        while Δθ = 0
//! ```
//!
//! The learned resistance is an average over the last motions and doubtful by 3/16, because a winding that warms up by 45 K gains so
//! much. Before a motion begins, the voltage rises past what friction holds, and the same winding is measured at the
//! same place of the commutator. What it then withholds from the current is back-EMF.
//!
//! A shaft counts as standing that has stood for a while before the voltage rose ([`super::super::break_away`]) and has shown no count
//! since, as long as nothing is demanded of it. An encoder that is silent while the shaft turns makes the resistance too high, and so
//! hides a motion; it never invents one.

use super::{Balance, Stretch, WINDING_BITS, Winding, product};
use crate::identify::positive::Positive;
use crate::protect::motion::Fresh;

/// Voltage from which on a current tells something, Q14, as a shift: 1/64 of nominal.
const LEAST_VOLTAGE_SHIFT: u32 = WINDING_BITS - 6;
/// The current must be so many times its unrest, as a shift: 8. The mean over some dozens of readings is then right within 2 %.
const CLEAR_SHIFT: u32 = 3;
/// Fraction bits of a ratio.
const RATIO_BITS: u32 = 16;
const ONE: i32 = 1 << RATIO_BITS;
/// Relative uncertainty that remains in any case: 1/64, for offset and linearity of the sensor.
const LEAST_SLACK: i32 = ONE / 64;
/// Beyond a quarter it is not the winding that was learned: brushes may drop a part of a small voltage.
const MOST_OFF: i32 = ONE / 4;

/// How far it has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    /// Nothing is demanded of the shaft.
    #[default]
    Gathers,
    /// It is from now on: time to compute.
    Over,
    Weighed,
}

/// The stretch in which the shaft stands, and what it tells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Standing {
    stretch: Stretch,
    stage: Stage,
    present: Option<Present>,
}

/// Resistance over the learned one, and how uncertain it is: shares, Q16.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Present {
    ratio: i32,
    pub slack: i32,
}

impl Standing {
    /// Has something been gathered?
    #[inline]
    pub fn gathers(&self) -> bool {
        self.stretch.ticks > 0
    }

    /// Is it time to compute?
    #[inline]
    pub fn is_over(&self) -> bool {
        self.stage == Stage::Over
    }

    /// One look: what it sums up, current and counter at its end. A function of its own: most looks are those of a shaft that turns.
    #[cold]
    #[inline(never)]
    pub fn step(&mut self, look: &Stretch, (current, count): (i32, i32), fresh: Fresh) {
        if !fresh.likely {
            if self.stage == Stage::Gathers && self.gathers() {
                self.stage = Stage::Over;
            }
            return;
        }
        (self.stage, self.present) = (Stage::Gathers, None);
        let driven = look.voltage.saturating_abs() >> LEAST_VOLTAGE_SHIFT >= look.ticks as i32;
        let on = !self.gathers() || look.voltage.signum() == self.stretch.voltage.signum();
        if fresh.stood && driven && on && self.stretch.turned(count) == 0 {
            self.stretch.add(look);
        } else {
            self.stretch = Stretch::begin(current, count);
        }
    }

    /// Computes the ratio: the current was `last` at the end of the stretch.
    #[cold]
    #[inline(never)]
    pub fn weigh(&mut self, known: Option<&Winding>, last: i32, unrest: i32) {
        self.stage = Stage::Weighed;
        self.present = known.and_then(|winding| self.ratio(winding, last, unrest));
    }

    fn ratio(&self, winding: &Winding, last: i32, unrest: i32) -> Option<Present> {
        let stretch = &self.stretch;
        let noise = product(unrest, stretch.ticks as i32) << CLEAR_SHIFT;
        // The unrest is Q4.
        if i64::from(stretch.current.saturating_abs()) << 4 < noise {
            return None;
        }
        let balance = winding.balance(stretch, last, unrest);
        let resisted = balance.offered.saturating_sub(balance.inductive);
        if resisted.signum() != balance.resistive.signum() {
            return None;
        }
        let share = |part: i64| {
            let whole = Positive::new(balance.resistive.unsigned_abs(), 0);
            Positive::new(part.unsigned_abs(), 0).over(whole).to_q(RATIO_BITS)
        };
        let ratio = share(resisted);
        // The inductance is known to a half; each reading of the current lies at the end of its tick, half a tick late.
        let rise =
            product(last.saturating_sub(stretch.first.0).saturating_abs(), winding.constants.resistance)
                >> 16;
        let doubtful =
            (balance.inductive.saturating_abs().saturating_add(rise) >> 1).saturating_add(balance.ends);
        let slack = share(doubtful).saturating_add(LEAST_SLACK);
        (ratio.saturating_sub(ONE).saturating_abs() < MOST_OFF).then_some(Present { ratio, slack })
    }

    /// What it tells about a shaft that the counter has not seen move since.
    #[inline]
    pub fn present(&self, count: i32) -> Option<&Present> {
        self.present.as_ref().filter(|_| self.stretch.turned(count) == 0)
    }
}

impl Present {
    /// Sets the resistive part of a balance right, and tells how uncertain it is.
    #[inline]
    pub fn applied(&self, balance: &mut Balance) -> i64 {
        // In two steps: 46 bits and 17 would be too many.
        let part = |of: i64, share: i32| (of >> 8).wrapping_mul(i64::from(share)) >> (RATIO_BITS - 8);
        balance.resistive = part(balance.resistive, self.ratio);
        part(balance.share(0), self.slack)
    }
}
