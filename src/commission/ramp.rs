//! What one rising voltage has shown: where the shaft began to turn, what the winding conducts, and whether its current
//! shows a motion that the counter does not.

use super::NO_CURRENT;
use crate::identify::estimate::Reason;

/// Counts that are motion, not a jittering edge.
pub(super) const MOTION: i32 = 4;
/// Voltages between which the winding's conductance is taken before anything moves, Q14: 4 … 8 %; and above which it is
/// taken again: 40 %.
pub(super) const QUIET: core::ops::Range<i32> = 655..1_311;
const LOUD: i32 = 6_554;
/// The middle of the first: a current that does not grow with the voltage from half to half has an offset.
const QUIET_MIDDLE: i32 = 983;
/// Share of the early conductance that is left at the top of the ramp, in quarters: at least three, and the motor stands;
/// back-EMF leaves the break-away voltage over the ramp's, at most 0.6.
const STALLED_QUARTERS: i64 = 3;

/// Share of the voltage that does not count as back-EMF, as a shift: 1/16; the early conductance is right within 3 %.
const DOUBT_SHIFT: u32 = 5;
/// The part of the quiet part's current that may be an offset, of 256: a quarter. A current that is sampled behind the middle of a pulse is
/// `U/L · (1 − d) · Δt` too high: 18 % at a duty `d` of 6 %, a `Δt` of 1.3 µs and an `L/R` of 0.12 ms.
const MOST_OFFSET: f32 = 64.0;
/// Counts, between two of which the counter shows no motion.
pub(super) const NONE_SHOWN: i32 = 2;

/// Time from the break-away to the first count, as a share of the time from there to the last of [`MOTION`], in quarters. At
/// constant acceleration 0.6 on average and 1 at most, by where the shaft stands between two edges; friction that falls to its
/// kinetic level makes it more.
const SINCE_START_QUARTERS: i32 = 3;
/// The most: the torque grows with the ramp from nothing, so four counts take 4^⅓ = 1.6 times as long as one.
const SINCE_START_MOST_QUARTERS: i32 = 7;

/// Ticks of one measurement of the conductance: 2¹² of 2¹⁵ counts fit into 32 bits, their products into 64.
const MOST_TICKS: i32 = 1 << 12;

/// Current and voltage, summed: the winding's conductance.
#[derive(Clone, Copy, Debug, Default)]
struct Conductance {
    current: i32,
    voltage: i32,
    ticks: i32,
}

impl Conductance {
    /// Notes the first [`MOST_TICKS`].
    fn note(&mut self, current: i32, voltage: i32) {
        if self.ticks < MOST_TICKS {
            self.current += current;
            self.voltage += voltage;
            self.ticks += 1;
        }
    }

    fn and(&self, other: &Self) -> Self {
        Self {
            current: self.current + other.current,
            voltage: self.voltage + other.voltage,
            ticks: self.ticks + other.ticks,
        }
    }

    /// Mean current and voltage.
    fn means(&self) -> (f32, f32) {
        let ticks = self.ticks.max(1) as f32;
        (self.current as f32 / ticks, self.voltage as f32 / ticks)
    }
}

/// One ramp.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ramp {
    /// Voltage of the last tick, Q14.
    pub(super) level: i32,
    /// Before anything moves, at its lower and its higher voltages.
    quiet: [Conductance; 2],
    /// The part of the quiet current that does not grow with the voltage, of 256; `None`: not known yet.
    offset: Option<u8>,
    /// At the top of the ramp.
    loud: Conductance,
    /// The shaft did not stand in the quiet part: it tells nothing about the winding.
    pub(super) unquiet: bool,
    /// Back-EMF since the motion began, beyond the doubt: Q14 · ticks · early current.
    pub(super) emf: i64,
    /// Displacement when it was 0 last.
    pub(super) emf_from: i32,
    /// Lowest displacement, counts: until there the motor still moved backwards.
    pub(super) lowest: i32,
    /// Ticks since then.
    pub(super) since_lowest: u32,
    /// Displacement at the last pause.
    pub(super) pause: i32,
    /// Voltage then, Q14.
    pub(super) pause_level: i32,
    /// Voltage in the last tick that showed no count beyond it, Q14.
    last_still: i32,
    /// Displacement at the last look.
    looked: i32,
    /// Ticks to the next look.
    next_look: u32,
    /// Path until it began.
    pub(super) path: u32,
}

impl Ramp {
    pub(super) fn begin(path: u32) -> Self {
        Self { path, ..Self::default() }
    }

    /// Notes the winding's current, converter counts, `None`: not sensed.
    pub(super) fn note_current(&mut self, raw: Option<i16>, sign: i32, level: i32) {
        let Some(raw) = raw else { return };
        let current = i32::from(raw) * sign;
        if QUIET.contains(&level) {
            self.quiet[usize::from(level >= QUIET_MIDDLE)].note(current, level);
        } else if level >= LOUD {
            self.loud.note(current, level);
        } else if level >= QUIET.end && self.offset.is_none() {
            self.offset = Some(self.offset());
        }
    }

    /// Does the current show a motion of so many Q14 · ticks of back-EMF? Winding and voltage: `v = R·i + emf`, with the R of
    /// the quiet part. A winding whose current lags looks more conductive later on, which hides a motion and invents none.
    pub(super) fn turns(&mut self, raw: Option<i16>, sign: i32, level: i32, most: i64) -> bool {
        let quiet = self.quiet[0].and(&self.quiet[1]);
        let Some(raw) = raw else { return false };
        if self.unquiet || level < QUIET.end || quiet.current <= NO_CURRENT.saturating_mul(quiet.ticks) {
            return false;
        }
        let current = i32::from(raw).wrapping_mul(sign);
        // A motor that turns draws what its friction takes; behind an input dead zone nothing flows yet, and what flowed in
        // the quiet part was the shaft's own drift.
        if current <= NO_CURRENT {
            return false;
        }
        let product = |a: i32, b: i32| i64::from(a).wrapping_mul(i64::from(b));
        let driven = product(level, quiet.current);
        let resistive = product(current, quiet.voltage);
        // The current that a rising voltage adds does not hold the offset.
        let risen = driven.wrapping_sub(product(quiet.voltage, quiet.current / quiet.ticks.max(1)));
        let offset = i64::from(self.offset.unwrap_or(MOST_OFFSET as u8));
        let doubt = (driven >> DOUBT_SHIFT).wrapping_add((risen >> 8).wrapping_mul(offset));
        let beyond = driven.wrapping_sub(doubt).wrapping_sub(resistive);
        self.emf = self.emf.saturating_add(beyond).max(0);
        self.emf > 0 && self.emf >= most.saturating_mul(i64::from(quiet.current))
    }

    /// The part of the quiet current that does not grow with the voltage, of 256.
    fn offset(&self) -> u8 {
        let [(low, low_v), (high, high_v)] = [self.quiet[0].means(), self.quiet[1].means()];
        let grown = (high - low) * (high_v + low_v) / ((high_v - low_v) * (high + low));
        // Not a number where a half is empty: then nothing is known of it.
        if grown.is_nan() { MOST_OFFSET as u8 } else { (256.0 * (1.0 - grown)).clamp(0.0, MOST_OFFSET) as u8 }
    }

    /// Voltage at which a shaft broke away that has now made its [`MOTION`] counts, Q14. It rose on while the shaft made its first
    /// count, and for less than the time that the others took.
    pub(super) fn started(&self, level: i32) -> i32 {
        let risen = level.saturating_sub(self.last_still).max(0);
        self.last_still.saturating_sub(risen * SINCE_START_QUARTERS / 4).max(1)
    }

    /// … at least: it then made its first count while the voltage rose so that the speed grew with the square of time.
    pub(super) fn started_least(&self, level: i32) -> i32 {
        let risen = level.saturating_sub(self.last_still).max(0);
        self.last_still.saturating_sub(risen.saturating_mul(SINCE_START_MOST_QUARTERS) / 4).max(1)
    }

    /// Has the shaft made [`MOTION`] counts since the last pause?
    pub(super) fn moved(&self, displacement: i32) -> bool {
        displacement.wrapping_sub(self.pause) >= MOTION
    }

    /// Why nothing was counted. Without a current sensor a stall and an unplugged encoder are the same data.
    pub(super) fn silence(&self, no_current: i32) -> Reason {
        let (quiet, loud) = (self.quiet[0].and(&self.quiet[1]), &self.loud);
        if loud.ticks == 0 {
            return Reason::NoMotion;
        }
        if loud.current < no_current.saturating_mul(loud.ticks) {
            return Reason::MotorDisconnected;
        }
        let late = i64::from(loud.current) * i64::from(quiet.voltage) * 4;
        let early = i64::from(quiet.current) * i64::from(loud.voltage) * STALLED_QUARTERS;
        if late >= early { Reason::Stalled } else { Reason::EncoderUnplugged }
    }

    /// Notes the displacement at a voltage. Is a look due?
    pub(super) fn note(&mut self, displacement: i32, level: i32) -> bool {
        self.since_lowest = self.since_lowest.saturating_add(1);
        if displacement <= self.pause {
            self.last_still = level;
        }
        if displacement < self.lowest {
            // It still moves backwards: a slow motor coasts, or a reversed one obeys.
            self.lowest = displacement;
            self.since_lowest = 0;
            (self.pause, self.pause_level) = (displacement, level);
        }
        let due = self.next_look == 0;
        self.next_look = self.next_look.saturating_sub(1);
        due
    }

    /// Has it hardly moved since the last look? `interval`: ticks between two looks; `slow`: counts in it at the speed of a pause.
    pub(super) fn look(&mut self, displacement: i32, level: i32, interval: u32, slow: i32) {
        self.next_look = interval;
        if displacement.wrapping_sub(self.looked) < slow.max(1) {
            (self.pause, self.pause_level) = (displacement, level);
        }
        self.looked = displacement;
    }
}
