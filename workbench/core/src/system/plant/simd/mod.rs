//! Several parameter sets in lock-step: the same step of the plant, written once, for one number or for one of each set.
//!
//! A search simulates the same record thousands of times with other parameters. A step waits for its own results, so a processor
//! that advances one set is idle most of the time; vector registers advance four or eight at once. `f64` is a set of its own: the
//! plain simulation is the same code. Nothing here fuses a product with a sum, so every set gets the same bits whatever stands
//! beside it.

mod pair;
mod register;
#[cfg(test)]
mod tests;

pub use pair::Pair;
pub use register::Register;
use std::f64::consts::{FRAC_1_PI, PI};
use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Added and taken away again, it rounds a number below 2⁵¹ to the nearest integer. Origin: 1.5 · 2⁵².
const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// The upper half of π's digits: its product with a number of half turns below 2²⁶ is exact.
const PI_HIGH: f64 = f64::from_bits(PI.to_bits() & !((1 << 26) - 1));
/// The lower half of its digits.
const PI_MIDDLE: f64 = PI - PI_HIGH;
/// What π has beyond a number of 64 bits. Origin: definition.
const PI_LOW: f64 = 1.224_646_799_147_353_2e-16;

/// sin(x)/x as a series of x², to x¹⁸. Origin: Taylor.
const SINE: [f64; 10] = alternating(2, 1.0);

/// 1, −1/(2·3), 1/(2·3·4·5), … where `stride` is 2: each coefficient is the one before over the next `stride` integers behind
/// `from`, with the other sign.
pub const fn alternating<const N: usize>(stride: usize, from: f64) -> [f64; N] {
    let mut coefficients = [1.0; N];
    let (mut last, mut k) = (from, 1);
    while k < N {
        coefficients[k] = -coefficients[k - 1];
        let mut factor = 0;
        while factor < stride {
            last += 1.0;
            coefficients[k] /= last;
            factor += 1;
        }
        k += 1;
    }
    coefficients
}

/// Yes or no for each set.
pub trait Mask: Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// True if it holds for one set at least.
    fn any(self) -> bool;

    /// True if it holds for every set.
    fn all(self) -> bool;
}

/// A part of a step that stands apart from the rest of the code: rare or long, so that it is not repeated wherever it is needed.
pub trait Apart {
    /// What it gives.
    type Output;

    /// Does it.
    fn run(self) -> Self::Output;
}

/// One number of each set.
pub trait Lanes:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Neg<Output = Self>
{
    /// Yes or no for each set.
    type Mask: Mask;

    /// Number of sets.
    const COUNT: usize;

    /// The same number for every set.
    fn like(self, value: f64) -> Self;

    /// Greater, number by number.
    fn gt(self, other: Self) -> Self::Mask;

    /// Greater or equal, number by number.
    fn ge(self, other: Self) -> Self::Mask;

    /// One or the other, number by number.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Without its sign.
    fn abs(self) -> Self;

    /// With the sign of another.
    fn copysign(self, sign: Self) -> Self;

    /// A function of one number, set by set.
    fn map(self, function: impl Fn(f64) -> f64) -> Self;

    /// One number a set, by the set's place.
    fn of(self, number: impl Fn(usize) -> f64) -> Self;

    /// The number of one set.
    fn lane(self, set: usize) -> f64;

    /// The first [`Self::COUNT`] numbers of a slice.
    fn load(self, from: &[f64]) -> Self;

    /// Writes them to the front of a slice.
    fn store(self, to: &mut [f64]);

    /// Appends one number of each set.
    fn push_to(self, to: &mut Vec<f64>);

    /// Runs a part as a function of its own, compiled for the same registers.
    fn apart<A: Apart>(self, part: A) -> A::Output;

    /// Less, number by number.
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        other.gt(self)
    }

    /// Less or equal, number by number.
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        other.ge(self)
    }

    /// The greater of two.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.gt(other), self, other)
    }

    /// The smaller of two.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(other.gt(self), self, other)
    }

    /// The sine of an angle, rad, to 1e-15 up to a million turns: the angle less a multiple of π in three parts (Cody, Waite: Software
    /// Manual for the Elementary Functions, 1980), then the series to the 19th power.
    #[inline(always)]
    fn sin(self) -> Self {
        let half_turns = (self * FRAC_1_PI + ROUNDING) - ROUNDING;
        let rest = ((self - half_turns * PI_HIGH) - half_turns * PI_MIDDLE) - half_turns * PI_LOW;
        let half = half_turns * 0.5;
        let odd = half - ((half + ROUNDING) - ROUNDING);
        let square = rest * rest;
        let series = self.polynomial(square, &SINE);
        rest * series * (-(odd * odd * 8.0) + 1.0)
    }

    /// The sum of coefficients times powers of `x`, the lowest power first: even and odd powers by Horner's rule each, so that
    /// one need not wait for the other. The lowest is added last, and alone decides the rounding.
    #[inline(always)]
    fn polynomial<const N: usize>(self, x: Self, coefficients: &[f64; N]) -> Self {
        let square = x * x;
        let mut sums = [self.like(0.0); 2];
        for power in (1..N).rev() {
            let (sum, first) = (&mut sums[power % 2], power + 2 >= N);
            let higher = if first { self.like(0.0) } else { *sum * square };
            *sum = higher + coefficients[power];
        }
        (sums[1] + sums[0] * x) * x + coefficients[0]
    }

    /// Between −`limit` and `limit`.
    #[inline(always)]
    fn within(self, limit: Self) -> Self {
        self.min(limit).max(-limit)
    }
}

/// exp(−x) of x that is not negative; 0 where nothing of it would be left in a sum with 1. (Far below the smallest number the
/// library's exp takes a slow way.)
#[inline(always)]
pub fn decayed(x: f64) -> f64 {
    if x > 40.0 { 0.0 } else { (-x).exp() }
}

impl Mask for bool {
    #[inline(always)]
    fn any(self) -> bool {
        self
    }

    #[inline(always)]
    fn all(self) -> bool {
        self
    }
}

impl Lanes for f64 {
    type Mask = bool;
    /// One set. Origin: definition.
    const COUNT: usize = 1;

    #[inline(always)]
    fn like(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn gt(self, other: Self) -> bool {
        self > other
    }

    #[inline(always)]
    fn ge(self, other: Self) -> bool {
        self >= other
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f64::copysign(self, sign)
    }

    #[inline(always)]
    fn map(self, function: impl Fn(f64) -> f64) -> Self {
        function(self)
    }

    #[inline(always)]
    fn of(self, number: impl Fn(usize) -> f64) -> Self {
        number(0)
    }

    #[inline(always)]
    fn lane(self, _: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn load(self, from: &[f64]) -> Self {
        from[0]
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[0] = self;
    }

    #[inline(always)]
    fn push_to(self, to: &mut Vec<f64>) {
        to.push(self);
    }

    #[inline(never)]
    fn apart<A: Apart>(self, part: A) -> A::Output {
        part.run()
    }
}
