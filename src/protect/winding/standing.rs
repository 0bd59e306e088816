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
    /// It is from now on: time to compute the resistance …
    Over,
    /// … and how uncertain it is, in another tick.
    Weighed,
    Known,
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
    /// Is there something to compute?
    #[inline]
    pub fn is_over(&self) -> bool {
        matches!(self.stage, Stage::Over | Stage::Weighed)
    }

    /// Is this look of any use, or has something been gathered? Most looks are those of a shaft that turns or is not driven.
    #[inline]
    pub fn heeds(&self, look: &Stretch) -> bool {
        self.stretch.ticks > 0 || drives(look)
    }

    /// One look at a shaft that has stood: what it sums up, current and counter at its end.
    #[cold]
    #[inline(never)]
    pub fn step(&mut self, look: &Stretch, (current, count): (i32, i32), fresh: Fresh) {
        if !fresh.likely {
            if self.stage == Stage::Gathers {
                self.stage = Stage::Over;
            }
            return;
        }
        let on = self.stage == Stage::Gathers
            && (self.stretch.ticks == 0 || look.voltage.signum() == self.stretch.voltage.signum());
        if on && drives(look) && self.stretch.turned(count) == 0 {
            self.stretch.add(look);
        } else {
            *self = Self { stretch: Stretch::begin(current, count), ..Self::default() };
        }
    }

    /// Computes the ratio, or how uncertain it is: the current was `last` at the end of the stretch.
    #[cold]
    #[inline(never)]
    pub fn weigh(&mut self, known: Option<&Winding>, last: i32, unrest: i32) {
        let first = self.stage == Stage::Over;
        self.stage = if first { Stage::Weighed } else { Stage::Known };
        let Some(winding) = known else { return };
        let balance = winding.balance(&self.stretch, last, unrest);
        let share = |part: i64| {
            let whole = Positive::new(balance.resistive.unsigned_abs(), 0);
            Positive::new(part.unsigned_abs(), 0).over(whole).to_q(RATIO_BITS)
        };
        if first {
            let resisted = balance.offered.wrapping_sub(balance.inductive);
            let ratio = share(resisted);
            let near = ratio.saturating_sub(ONE).saturating_abs() < MOST_OFF;
            let same = (resisted ^ balance.resistive) >= 0;
            let sound = near && same && self.is_clear(unrest);
            self.present = sound.then_some(Present { ratio, slack: i32::MAX });
        } else if let Some(present) = &mut self.present {
            // The inductance is known to a half; each reading of the current lies at the end of its tick, half a tick late.
            let rise = last.saturating_sub(self.stretch.first.0).saturating_abs();
            let late = product(rise, winding.constants.resistance) >> 16;
            let doubtful =
                (balance.inductive.wrapping_abs().wrapping_add(late) >> 1).wrapping_add(balance.ends);
            present.slack = share(doubtful).saturating_add(LEAST_SLACK);
        }
    }

    /// Does the current stand out of its noise?
    fn is_clear(&self, unrest: i32) -> bool {
        // The unrest is Q4.
        let noise = product(unrest, self.stretch.ticks as i32) << CLEAR_SHIFT;
        i64::from(self.stretch.current.saturating_abs()) << 4 >= noise
    }

    /// What it tells about a shaft that the counter has not seen move since.
    #[inline]
    pub fn present(&self, count: i32) -> Option<&Present> {
        self.present.as_ref().filter(|_| self.stretch.turned(count) == 0)
    }
}

/// Does its voltage drive a current that tells something?
#[inline]
fn drives(look: &Stretch) -> bool {
    look.voltage.saturating_abs() >> LEAST_VOLTAGE_SHIFT >= look.ticks as i32
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
