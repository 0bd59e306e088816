//! Quantities of the control tick as integers, each with its least significant bit (LSB).
//!
//! | type | unit | LSB | range |
//! |---|---|---|---|
//! | [`Position`] | encoder counts | 2⁻³² | ±2³¹, wraps with the counter |
//! | [`Speed`] | counts per tick | 2⁻²⁰ | ±2,048, saturates |
//! | [`Acceleration`] | counts per tick² | 2⁻²⁴ | ±128, saturates |
//! | [`Voltage`] | nominal supply voltages | 2⁻²⁰ | ±2,048, saturates |
//!
//! A position is always used as a difference, so wrapping is exact. Everything else saturates: an actuator at its
//! limit is a state that the loops know, a number that turned its sign is not.

/// Fraction bits of [`Voltage`].
pub const VOLTAGE_BITS: u32 = 20;
/// Fraction bits of [`Speed`].
pub const SPEED_BITS: u32 = 20;
/// Fraction bits of [`Acceleration`].
pub const ACCELERATION_BITS: u32 = 24;
/// Fraction bits of the position error that the loops multiply (see [`Position::minus`]).
pub const ERROR_BITS: u32 = 12;

/// Angle in encoder counts, Q32, wrapping with the 32-bit counter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Position(pub i64);

impl Position {
    /// The middle of the interval in which a counter that reads `count` can be: `count + ½`.
    #[must_use]
    #[inline]
    pub const fn of_count(count: i32) -> Self {
        Self(((count as i64) << 32) | (1 << 31))
    }

    /// Moved on by `counts`, given in Q32.
    #[must_use]
    #[inline]
    pub const fn plus(self, counts_q32: i64) -> Self {
        Self(self.0.wrapping_add(counts_q32))
    }

    /// The count that contains this position.
    #[must_use]
    #[inline]
    pub const fn count(self) -> i32 {
        (self.0 >> 32) as i32
    }

    /// Relative to the counter reading `zero`, counts Q8, modulo 2²⁴ counts: beside a count it tells the whole.
    #[must_use]
    #[inline]
    pub const fn relative_q8(self, zero: i32) -> i32 {
        (self.0.wrapping_sub((zero as i64) << 32) >> 24) as i32
    }

    /// `self − other` in counts, Q12, saturating at ±2¹⁹ counts.
    #[must_use]
    #[inline]
    pub fn minus(self, other: Self) -> i32 {
        const MOST: i32 = 1 << (31 - ERROR_BITS);
        let difference = self.0.wrapping_sub(other.0);
        let (low, high) = (difference as u32, (difference >> 32) as i32);
        if within(high, MOST) {
            (high << ERROR_BITS) | (low >> (32 - ERROR_BITS)) as i32
        } else {
            (high >> 31) ^ i32::MAX
        }
    }
}

/// Speed in counts per tick, Q20.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Speed(pub i32);

impl Speed {
    /// Travel of one tick at this speed, counts Q32.
    #[must_use]
    #[inline]
    pub const fn per_tick(self) -> i64 {
        (self.0 as i64) << (32 - SPEED_BITS)
    }
}

/// Acceleration in counts per tick², Q24.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Acceleration(pub i32);

/// Voltage in units of the nominal supply, Q20.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Voltage(pub i32);

impl Voltage {
    /// Fraction bits.
    pub const BITS: u32 = VOLTAGE_BITS;
    /// No voltage.
    pub const ZERO: Self = Self(0);
    /// The nominal supply voltage.
    pub const NOMINAL: Self = Self(1 << VOLTAGE_BITS);

    /// Sum, saturating.
    #[must_use]
    #[inline]
    pub const fn plus(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }

    /// Difference, saturating.
    #[must_use]
    #[inline]
    pub const fn minus(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }

    /// Rounded to nearest, in the identifier's format.
    #[must_use]
    #[inline]
    pub const fn q14(self) -> VoltageQ14 {
        VoltageQ14(self.0.saturating_add(1 << (VOLTAGE_BITS - 15)) >> (VOLTAGE_BITS - 14))
    }

    /// From the identifier's format.
    #[must_use]
    #[inline]
    pub const fn from_q14(voltage: VoltageQ14) -> Self {
        Self(voltage.0.saturating_mul(1 << (VOLTAGE_BITS - 14)))
    }
}

/// A voltage in Q14 of the nominal supply (LSB 2⁻¹⁴ nominal supplies, range ±2), as the identifier sums it: five integrations
/// of a Q20 number would not fit into 64 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct VoltageQ14(pub i32);

impl VoltageQ14 {
    /// The nominal supply.
    pub const NOMINAL: Self = Self(1 << 14);
}

/// `value` cut to 32 bits. It fits if the upper word only repeats the sign of the lower one: one comparison, where two
/// 64-bit ones would need a dozen instructions.
#[must_use]
#[inline(always)]
pub const fn saturate(value: i64) -> i32 {
    let (low, high) = (value as i32, (value >> 32) as i32);
    if high == low >> 31 { low } else { (high >> 31) ^ i32::MAX }
}

/// `value` cut to −`limit` … `limit`; `limit` ≥ 0. Unlike `i32::clamp` it has no way to a panic.
#[must_use]
#[inline(always)]
pub fn limited(value: i32, limit: i32) -> i32 {
    value.max(limit.wrapping_neg()).min(limit)
}

/// Is −`limit` ≤ `value` < `limit`? One comparison; `limit` is positive.
#[inline(always)]
const fn within(value: i32, limit: i32) -> bool {
    (value.wrapping_add(limit) as u32) < (limit as u32) << 1
}

/// `value` within −`limit`·2³² … `limit`·2³² − 1. The upper word alone decides.
#[must_use]
#[inline(always)]
pub const fn bounded(value: i64, limit: i32) -> i64 {
    let high = (value >> 32) as i32;
    if within(high, limit) { value } else { end(high, limit) }
}

/// The end of ±`limit`·2³² on the side of `high`: out of line, for what is bounded is nearly always within.
#[cold]
#[inline(never)]
const fn end(high: i32, limit: i32) -> i64 {
    if high < 0 { -((limit as i64) << 32) } else { ((limit as i64) << 32).wrapping_sub(1) }
}

/// `value · gain / 2^shift`, rounded to nearest, saturating; `shift` is 1 … 62 and should be a constant: the core has
/// no 64-bit shift by a register.
///
/// One `SMLAL`, one `SSAT` and a shift: the upper word of the product alone is held within its range, so that what does
/// not fit becomes one of the last 2^(32 − `shift`) numbers before ±2³¹.
#[must_use]
#[inline(always)]
pub const fn mul_shift(value: i32, gain: i32, shift: u32) -> i32 {
    if shift >= 32 {
        return mul_shift_within(value, gain, shift);
    }
    let product = product(value, gain, shift);
    let (low, high) = (product as u32, (product >> 32) as i32);
    let limit = 1i32 << (shift.wrapping_sub(1) & 31);
    let held = if high >= limit {
        limit.wrapping_sub(1)
    } else if high < limit.wrapping_neg() {
        limit.wrapping_neg()
    } else {
        high
    };
    (held << (32u32.wrapping_sub(shift) & 31)) | (low >> (shift & 31)) as i32
}

/// `value · gain / 2^shift`, rounded to nearest, for products that are known to fit into 32 bits; otherwise it wraps.
#[must_use]
#[inline(always)]
pub const fn mul_shift_within(value: i32, gain: i32, shift: u32) -> i32 {
    (product(value, gain, shift) >> (shift & 63)) as i32
}

/// `value · gain / 2³²`, rounded to nearest: one instruction, `SMMULR`. It always fits.
#[must_use]
#[inline(always)]
pub const fn mul_high(value: i32, gain: i32) -> i32 {
    mul_shift_within(value, gain, 32)
}

/// `value · gain` and the half that rounds a later shift.
#[inline(always)]
const fn product(value: i32, gain: i32, shift: u32) -> i64 {
    (value as i64).wrapping_mul(gain as i64).wrapping_add(1i64 << (shift.wrapping_sub(1) & 63))
}

/// `value · 2^bits` as the nearest integer that fits in 32 bits, for parameters that are set up once.
#[must_use]
// A call takes a third of the image that its body takes, at some fifty places.
#[inline(never)]
pub fn to_fixed(value: f32, bits: u32) -> i32 {
    // 2^bits by its exponent: there is no instruction that converts 64 bits.
    let scaled = value * f32::from_bits(127u32.wrapping_add(bits) << 23);
    (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
}

/// The integer of 64 bits towards zero, saturating. Its body at each of its places would take more of the image.
#[must_use]
#[inline(never)]
pub const fn whole(value: f32) -> i64 {
    value as i64
}

/// A distance, counts Q32, as counts. By its halves, an instruction each: one of 64 bits would take 120 bytes of the image.
#[must_use]
#[inline]
pub fn counts_in(distance: i64) -> f32 {
    (distance >> 32) as i32 as f32 + distance as u32 as f32 / 4_294_967_296.0
}

/// Sine of `phase` (2³² a turn), Q30, within four of its last places.
#[inline]
pub(crate) fn sin(phase: u32) -> i32 {
    let turned = phase as i32;
    // −x; beyond a quarter turn sin(π − x) = sin x. Then ±1 in Q30 is ±90°.
    let x = if (turned ^ (turned << 1)) < 0 { turned.wrapping_sub(i32::MIN) } else { turned.wrapping_neg() };
    // −x²/2 in Q32: for x = −1 … 1 it is −2³¹ … 0, so that the upper word of a product with it is all that is needed.
    let z = mul_high(x << 1, x << 1).wrapping_neg() << 1;
    let horner = |sum: i32, coefficient: i32| mul_high(sum, z).wrapping_add(coefficient);
    // Written out: an image optimised for size would keep a loop.
    let [a, b, c, d, e, f, g] = TAYLOR;
    let sum = horner(horner(horner(horner(horner(horner(a, b), c), d), e), f), g);
    mul_shift_within(sum, x, 30)
}

/// Taylor coefficients of −sin(πx/2)/x in −x²/2, from the sixth power down to the constant, Q30: −2ᵏ·(π/2)ⁿ/n! with
/// n = 2k + 1. The first one left out is 7·10⁻¹⁰. Negative, like −x²/2: of sums that it knows to be positive the compiler
/// makes unsigned numbers, and a product of two signs takes seven instructions instead of one.
const TAYLOR: [i32; 7] =
    [-3_912, -123_655, -2_756_359, -40_215_962, -342_277_223, -1_387_197_337, -1_686_629_713];

/// Fraction bits of a time constant (LSB = a sixteenth of a control tick).
pub const LAG_FRAC: u32 = 4;
/// A control tick as a time constant: the shortest that a low pass has.
pub const ONE_TICK: u32 = 1 << LAG_FRAC;

/// Part of its way that a low pass with this time constant, control ticks Q4, goes in a tick, Q30.
#[must_use]
pub const fn low_pass_step(time: u32) -> i32 {
    let time = if time < ONE_TICK { ONE_TICK } else { time };
    ((u32::MAX / time) << (30 + LAG_FRAC - u32::BITS)) as i32
}

/// A low pass of first order, with 16 bits more than its input: a slow one still moves by what is left of a place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LowPass(i64);

impl LowPass {
    const BITS: u32 = 16;

    /// One tick towards an input. Returns what it keeps back of it before.
    #[inline]
    pub fn pass(&mut self, input: i32, step: i32) -> i32 {
        let kept_back = input.saturating_sub((self.0 >> Self::BITS) as i32);
        let way = i64::from(kept_back).wrapping_mul(i64::from(step)) >> (30 - Self::BITS);
        self.0 = self.0.wrapping_add(way);
        kept_back
    }

    /// The mean of what it says now and said before.
    #[must_use]
    #[inline]
    pub fn since(&self, before: Self) -> i32 {
        (before.0.wrapping_add(self.0) >> (Self::BITS + 1)) as i32
    }
}

/// Control ticks in so many milliseconds, rounded down; saturates. Without a 64-bit division, which would take 900 bytes of
/// the image.
#[must_use]
pub const fn ticks_in(milliseconds: u32, tick_hz: u32) -> u32 {
    let (seconds, rest) = (milliseconds / 1000, milliseconds % 1000);
    seconds.saturating_mul(tick_hz).saturating_add(rest.saturating_mul(tick_hz) / 1000)
}

/// A sense of rotation, and the index of what is kept for each of the two.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Direction {
    /// Positive voltage, rising count.
    #[default]
    Positive = 0,
    /// Negative voltage, falling count.
    Negative = 1,
}

impl Direction {
    /// Both, in the order of their indices.
    pub const BOTH: [Self; 2] = [Self::Positive, Self::Negative];

    /// The direction of a number that is not zero.
    #[must_use]
    #[inline]
    pub const fn of(number: i32) -> Self {
        if number < 0 { Self::Negative } else { Self::Positive }
    }

    /// The other one.
    #[must_use]
    #[inline]
    pub const fn reversed(self) -> Self {
        match self {
            Self::Positive => Self::Negative,
            Self::Negative => Self::Positive,
        }
    }

    /// +1 or −1.
    #[must_use]
    #[inline]
    pub const fn sign(self) -> i32 {
        match self {
            Self::Positive => 1,
            Self::Negative => -1,
        }
    }
}

impl<T> core::ops::Index<Direction> for [T; 2] {
    type Output = T;

    #[inline]
    fn index(&self, direction: Direction) -> &T {
        let [positive, negative] = self;
        match direction {
            Direction::Positive => positive,
            Direction::Negative => negative,
        }
    }
}

impl<T> core::ops::IndexMut<Direction> for [T; 2] {
    #[inline]
    fn index_mut(&mut self, direction: Direction) -> &mut T {
        let [positive, negative] = self;
        match direction {
            Direction::Positive => positive,
            Direction::Negative => negative,
        }
    }
}
