//! B-spline averages of count and voltage: the regression's signals without a differentiated speed and without memory.
//!
//! The fourth-order B-spline of block length N is N·δ-free: convolved with a signal it is the comb Δ_N⁴ of that signal's
//! fourfold running sum (a cascaded integrator–comb filter, Hogenauer 1981). Taking one, two or three sums fewer on the
//! count than on the voltage gives *the same average* of jerk, acceleration and speed (modulating functions, Shinbrot
//! 1957; Preisig & Rippin 1993): a step of voltage inside the window is represented exactly, and a window is valid or
//! dropped, never "settling".
//!
//! Per control tick only `Σ count` and `Σ voltage` grow (32 bit). Every D = 2^`decimation` ticks, at 1…2 kHz, the 64-bit
//! integrators advance; they wrap, the comb is exact modulo 2⁶⁴. Every N/4 of these a snapshot enters a ring, and the
//! window that ends there is available.
//!
//! Magnitudes: the largest comb, that of the voltage, is 2·D²·N⁴·2¹⁴ ≤ 2⁶¹ for D = 16, N = 512.

use crate::units::saturate;
use core::num::Wrapping;

/// Snapshots per block.
pub const HOPS_PER_BLOCK: u32 = 4;
/// Snapshots that one window spans.
pub const HOPS_PER_WINDOW: u32 = 4 * HOPS_PER_BLOCK;
/// Fractional bits of every number in a [`Window`].
pub const ROW_FRAC: u32 = 20;
/// Fractional bits of a voltage that enters.
const VOLTAGE_FRAC: u32 = 14;
const RING: usize = HOPS_PER_WINDOW as usize + 1;

/// Averages over one window. Unit of speed: W₀ = 2^`counts` counts per block; of time: one block; of voltage: nominal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Window {
    /// Mean speed, Q20.
    pub speed: i32,
    /// Mean acceleration, Q20.
    pub acceleration: i32,
    /// Mean jerk, Q20.
    pub jerk: i32,
    /// Mean voltage, Q20.
    pub voltage: i32,
}

/// What one hop saw, besides the sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hop {
    /// Lowest voltage, Q14.
    pub lowest: i32,
    /// Highest voltage, Q14.
    pub highest: i32,
    /// Position at the end, counts from the start, wraps.
    pub position: i32,
}

/// Lengths as powers of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lengths {
    /// log₂ of control ticks per sample, D.
    pub decimation: u32,
    /// log₂ of samples per block, N. 3 … 9.
    pub block: u32,
    /// log₂ of W₀ in counts per block.
    pub counts: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Snapshot {
    jerk: Wrapping<i64>,
    acceleration: Wrapping<i64>,
    speed: Wrapping<i64>,
    voltage: Wrapping<i64>,
}

impl Snapshot {
    #[inline]
    fn parts(&self) -> [Wrapping<i64>; 4] {
        [self.jerk, self.acceleration, self.speed, self.voltage]
    }
}

/// Sums and the ring of snapshots.
#[derive(Clone, Copy, Debug)]
pub struct State {
    reference: i32,
    position: Wrapping<i64>,
    count_sum: Wrapping<i32>,
    voltage_sum: Wrapping<i32>,
    acting: i32,
    count_integrals: [Wrapping<i64>; 3],
    voltage_integrals: [Wrapping<i64>; 4],
    /// The one under way.
    lowest: i32,
    highest: i32,
    /// Control ticks per sample, D.
    ticks: u16,
    ticks_left: u16,
    samples_left: u16,
    /// The last one that ended.
    hop: Hop,
    ring: [Snapshot; RING],
    newest: u8,
    filled: u8,
}

impl State {
    /// Starts at `count`, at rest, without voltage.
    #[inline(always)]
    pub fn new(count: i32, lengths: &Lengths) -> Self {
        State {
            reference: count,
            position: Wrapping(0),
            count_sum: Wrapping(0),
            voltage_sum: Wrapping(0),
            acting: 0,
            count_integrals: [Wrapping(0); 3],
            voltage_integrals: [Wrapping(0); 4],
            lowest: i32::MAX,
            highest: i32::MIN,
            ticks: lengths.ticks_per_sample(),
            ticks_left: lengths.ticks_per_sample(),
            samples_left: lengths.samples_per_hop(),
            hop: Hop::default(),
            ring: [Snapshot::default(); RING],
            newest: 0,
            filled: 0,
        }
    }

    /// The window must refill before the next result (after a change of lengths).
    #[inline]
    pub fn restart(&mut self, lengths: &Lengths) {
        self.samples_left = lengths.samples_per_hop();
        self.filled = 0;
    }

    /// The next sample is complete in so many ticks, at most those of a sample. Behind [`State::restart`] alone: what it then lacks
    /// lies before the first snapshot of a window, and the comb takes it off like all that was summed before.
    pub fn align(&mut self, ticks: u32) {
        self.ticks_left = self.ticks.min(ticks as u16);
    }

    /// Sums one tick: the count now, and the voltage that acts from now on. `true`: a [`Hop`] ends here.
    #[inline(always)]
    pub fn step(&mut self, lengths: &Lengths, count: i32, voltage: i32) -> bool {
        let offset = count.wrapping_sub(self.reference);
        self.count_sum += offset;
        self.voltage_sum += self.acting;
        self.lowest = self.lowest.min(self.acting);
        self.highest = self.highest.max(self.acting);
        self.acting = voltage;
        self.ticks_left = self.ticks_left.wrapping_sub(1);
        self.ticks_left == 0 && self.sampled(lengths, count)
    }

    /// A sample is complete: what most ticks do not come to, and therefore out of line. `true`: a [`Hop`] ends too.
    #[cold]
    #[inline]
    fn sampled(&mut self, lengths: &Lengths, count: i32) -> bool {
        self.sample(count.wrapping_sub(self.reference));
        self.reference = count;
        self.samples_left = self.samples_left.wrapping_sub(1);
        if self.samples_left != 0 {
            return false;
        }
        self.end_hop(lengths);
        true
    }

    /// Does the next tick complete a sample, though not every tick does?
    #[inline]
    pub fn is_sampling(&self) -> bool {
        self.ticks_left == 1 && self.ticks > 1
    }

    /// The last hop that ended.
    #[inline]
    pub fn hop(&self) -> &Hop {
        &self.hop
    }

    #[inline]
    fn sample(&mut self, offset: i32) {
        // A product by the number of ticks: the core has no 64-bit shift by a register.
        let count = self.position * Wrapping(i64::from(self.ticks)) + Wrapping(i64::from(self.count_sum.0));
        // Written out: an image optimised for size would keep a loop.
        let [first, second, third] = &mut self.count_integrals;
        add(third, add(second, add(first, count)));
        let [first, second, third, fourth] = &mut self.voltage_integrals;
        add(fourth, add(third, add(second, add(first, Wrapping(i64::from(self.voltage_sum.0))))));
        self.position += i64::from(offset);
        self.count_sum = Wrapping(0);
        self.voltage_sum = Wrapping(0);
        self.ticks_left = self.ticks;
    }

    /// The averages' centres differ by fractions of a sample: count sums start at the sample, voltage acts after it.
    /// `2·I₃ − I₂` moves the speed back by half a sample, `2D·J₄ − (2D−1)·J₃` the voltage by 1 − 1/(2D).
    #[inline]
    fn end_hop(&mut self, lengths: &Lengths) {
        let [i1, i2, i3] = self.count_integrals;
        let [.., j3, j4] = self.voltage_integrals;
        let twice = lengths.decimation.wrapping_add(1);
        self.newest = self.newest.wrapping_add(1);
        if usize::from(self.newest) >= RING {
            self.newest = 0;
        }
        if let Some(slot) = self.ring.get_mut(self.newest as usize) {
            *slot = Snapshot {
                jerk: i1,
                acceleration: i2,
                speed: i3 + i3 - i2,
                voltage: Wrapping((j4 - j3).0.wrapping_shl(twice)) + j3,
            };
        }
        self.filled = self.filled.saturating_add(1).min(RING as u8);
        self.samples_left = lengths.samples_per_hop();
        self.hop = Hop { lowest: self.lowest, highest: self.highest, position: self.position.0 as i32 };
        self.lowest = i32::MAX;
        self.highest = i32::MIN;
    }

    /// The window that ended with the last hop; `None` until it is filled.
    #[inline]
    pub fn window(&self, lengths: &Lengths) -> Option<Window> {
        if usize::from(self.filled) < RING {
            return None;
        }
        let [jerk, acceleration, speed, voltage] = self.comb();
        let Lengths { decimation, block, counts } = *lengths;
        let sum = |parts: [u32; 3]| parts.into_iter().fold(0, u32::wrapping_add);
        let motion = sum([decimation, counts, block]);
        let twice = block.wrapping_shl(1);
        Some(Window {
            jerk: scaled(jerk, motion),
            acceleration: scaled(acceleration, sum([motion, block, 0])),
            speed: scaled(speed, sum([motion, twice, 1])),
            voltage: scaled(
                voltage,
                sum([VOLTAGE_FRAC + 1, decimation.wrapping_shl(1), twice.wrapping_shl(1)]),
            ),
        })
    }

    /// Δ⁴ with a lag of one block, coefficients 1 −4 6 −4 1: ends + 4·(middle − inner) + 2·middle, so that no 64-bit number
    /// is multiplied.
    #[inline]
    fn comb(&self) -> [i64; 4] {
        let [s0, s1, s2, s3, s4] = [0, 1, 2, 3, 4].map(|lag| self.before(lag).parts());
        let mut comb = [0i64; 4];
        for (i, comb) in comb.iter_mut().enumerate() {
            let (ends, middle) = (s0[i] + s4[i], s2[i]);
            let bend = middle - (s1[i] + s3[i]);
            *comb = (ends + (bend << 2) + (middle << 1)).0;
        }
        comb
    }

    /// The snapshot so many blocks before the newest.
    #[inline]
    fn before(&self, blocks: usize) -> &Snapshot {
        let back = blocks * HOPS_PER_BLOCK as usize;
        let newest = usize::from(self.newest);
        let at = newest.checked_sub(back).unwrap_or(newest.wrapping_add(RING).wrapping_sub(back));
        self.ring.get(at).unwrap_or(&self.ring[0])
    }
}

impl Lengths {
    #[inline]
    const fn samples_per_hop(&self) -> u16 {
        (1u32.wrapping_shl(self.block) / HOPS_PER_BLOCK) as u16
    }

    #[inline]
    const fn ticks_per_sample(&self) -> u16 {
        1u16.wrapping_shl(self.decimation)
    }
}

/// One integrator: takes `input` and returns its sum.
#[inline(always)]
fn add(integral: &mut Wrapping<i64>, input: Wrapping<i64>) -> Wrapping<i64> {
    *integral += input;
    *integral
}

/// `value · 2^(ROW_FRAC − bits)`, rounded, saturating.
#[inline]
fn scaled(value: i64, bits: u32) -> i32 {
    let scaled = match bits.checked_sub(ROW_FRAC) {
        Some(0) => value,
        Some(right) => value.wrapping_shr(right.wrapping_sub(1)).wrapping_add(1) >> 1,
        None => value.wrapping_shl(ROW_FRAC.wrapping_sub(bits)),
    };
    saturate(scaled)
}
