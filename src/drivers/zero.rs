//! The zero of a current sensor: its mean reading while the bridge is open, looked for from power-up on, and followed once it
//! is known.
//!
//! A driven or shorted bridge carries current, and a steady current reads like a zero: such readings never count. Readings
//! that spread too far, or whose mean no sensor at rest can have, are no zero either. The wait is bounded; when it is over
//! there is a reason, and the search goes on whenever the bridge is open.
//!
//! An offset drifts with temperature: 10 µV/°C before an amplifier of 80 V/V are 1 count/°C. So each later mean moves a known
//! zero by one count towards it, 10 counts a second at most, where the bridge was open and the shaft stood for all of it: a
//! shaft that is driven from outside, faster than the supply's voltage allows, feeds a current back through an open bridge.

use crate::axis::Bridge;
use core::cmp::Ordering;

/// Ticks with an open bridge before the first reading counts: an open bridge acts up to two ticks later, and the current
/// of the winding has to decay.
const SETTLING: u8 = 16;
/// How many means the wait lasts.
const PATIENCE: u32 = 4;

/// What a zero has to fulfil.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ZeroLimits {
    /// Number of readings in a mean as a power of two, k. 0 … 15.
    pub readings_log2: u8,
    /// Lowest and highest zero that the sensor may have, counts.
    pub window: (u16, u16),
    /// Largest spread (highest − lowest reading) of a sensor at rest, counts.
    pub spread: u16,
}

impl ZeroLimits {
    fn readings(&self) -> u32 {
        1 << self.readings_log2.min(15)
    }
}

/// Why there is no zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The readings spread too far: current flows, or the input floats.
    Unsteady,
    /// The mean lies outside the window: sensor missing, miswired or broken.
    OutsideWindow,
    /// The bridge was not open long enough for a mean.
    BridgeNotOpen,
}

/// What is known of the zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Zero {
    /// Not yet known, and the wait is not over.
    Sought,
    /// Counts.
    Known(u16),
    /// The wait is over.
    Missing(Reason),
}

/// The search for one sensor's zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ZeroSearch {
    limits: ZeroLimits,
    zero: Zero,
    reason: Reason,
    /// Ticks since the beginning, up to the end of the wait.
    waited: u32,
    /// Ticks for which the bridge has been open, up to [`SETTLING`].
    open: u8,
    mean: Mean,
}

impl ZeroSearch {
    /// Nothing read yet.
    #[must_use]
    pub const fn new(limits: ZeroLimits) -> Self {
        Self {
            limits,
            zero: Zero::Sought,
            reason: Reason::BridgeNotOpen,
            waited: 0,
            open: 0,
            mean: Mean::EMPTY,
        }
    }

    /// What is known of it now.
    pub const fn zero(&self) -> Zero {
        self.zero
    }

    /// One reading, and what the bridge was last told to do before it.
    #[inline]
    pub fn step(&mut self, raw: u16, bridge: Bridge) -> Zero {
        if bridge == Bridge::Open || !self.is_known() {
            self.look(raw, bridge);
        } else {
            self.open = 0;
        }
        self.zero
    }

    /// The shaft has moved: a known zero waits until it stands again. The first one is not kept waiting by it.
    #[inline]
    pub fn moved(&mut self) {
        if self.is_known() {
            self.open = 0;
        }
    }

    #[inline]
    const fn is_known(&self) -> bool {
        matches!(self.zero, Zero::Known(_))
    }

    /// Kept out of the tick of an axis that is driven.
    #[cold]
    #[inline(never)]
    fn look(&mut self, raw: u16, bridge: Bridge) {
        if bridge != Bridge::Open {
            self.open = 0;
        } else if self.open < SETTLING {
            self.open = self.open.saturating_add(1);
            self.mean = Mean::EMPTY;
        } else {
            self.mean.add(raw);
            if self.mean.taken >= self.limits.readings() {
                self.judge();
            }
        }
        self.wait();
    }

    fn judge(&mut self) {
        match (self.mean.verdict(&self.limits), self.zero) {
            (Ok(mean), Zero::Known(zero)) => self.zero = Zero::Known(towards(zero, mean)),
            (Ok(mean), _) => self.zero = Zero::Known(mean),
            (Err(reason), _) => self.reason = reason,
        }
        self.mean = Mean::EMPTY;
    }

    fn wait(&mut self) {
        let patience = self.limits.readings().saturating_mul(PATIENCE);
        if self.waited < patience {
            self.waited = self.waited.saturating_add(1);
        } else if !self.is_known() {
            self.zero = Zero::Missing(self.reason);
        }
    }
}

/// One count nearer to `mean`.
fn towards(zero: u16, mean: u16) -> u16 {
    match mean.cmp(&zero) {
        Ordering::Less => zero.saturating_sub(1),
        Ordering::Equal => zero,
        Ordering::Greater => zero.saturating_add(1),
    }
}

/// A mean under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Mean {
    sum: u32,
    taken: u32,
    lowest: u16,
    highest: u16,
}

impl Mean {
    const EMPTY: Self = Self { sum: 0, taken: 0, lowest: u16::MAX, highest: 0 };

    fn add(&mut self, raw: u16) {
        // 2¹⁵ readings of 16 bits stay below 2³¹.
        self.sum = self.sum.saturating_add(u32::from(raw));
        self.taken = self.taken.saturating_add(1);
        self.lowest = self.lowest.min(raw);
        self.highest = self.highest.max(raw);
    }

    /// The zero, rounded, or why it is none.
    fn verdict(&self, limits: &ZeroLimits) -> Result<u16, Reason> {
        let count = limits.readings();
        // A mean of 16-bit readings fits 16 bits.
        let mean = (self.sum.saturating_add(count / 2) >> limits.readings_log2.min(15)) as u16;
        if self.highest.saturating_sub(self.lowest) > limits.spread {
            return Err(Reason::Unsteady);
        }
        if mean < limits.window.0 || mean > limits.window.1 {
            return Err(Reason::OutsideWindow);
        }
        Ok(mean)
    }
}
