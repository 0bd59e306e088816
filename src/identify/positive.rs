//! Positive numbers with a wide range, in integers: uncertainties and quotients, a handful per solution.
//!
//! 32 bits of mantissa, no rounding modes, no infinities: results below the smallest are zero, above the largest they
//! stay at the largest. Relative error of every operation ≤ 2⁻²⁹.

/// `mantissa · 2^exponent`; the mantissa's top bit is set unless the number is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Positive {
    mantissa: u32,
    exponent: i32,
}

// One copy of each operation in the image: inlined at some sixty places they would take 10 KiB.
impl Positive {
    /// `value · 2^exponent`.
    #[cold]
    #[inline]
    pub fn new(value: u64, exponent: i32) -> Self {
        if value == 0 {
            return Positive::default();
        }
        let zeros = value.leading_zeros();
        let mantissa = ((value << zeros) >> 32) as u32;
        Positive { mantissa, exponent: exponent.saturating_add(32 - zeros as i32) }
    }

    /// |value| · 2^−`frac`.
    #[inline]
    pub fn of(value: i32, frac: u32) -> Self {
        let magnitude = value.unsigned_abs();
        if magnitude == 0 {
            return Positive::default();
        }
        let zeros = magnitude.leading_zeros();
        Positive { mantissa: magnitude << zeros, exponent: (frac.wrapping_add(zeros) as i32).wrapping_neg() }
    }

    /// Product.
    #[inline]
    pub fn times(self, other: Self) -> Self {
        let product = u64::from(self.mantissa) * u64::from(other.mantissa);
        let exponent = self.exponent.saturating_add(other.exponent);
        // Both top bits are set, so that of the product is one of the two highest.
        let high = (product >> 32) as u32;
        match high.leading_zeros() {
            0 => Positive { mantissa: high, exponent: exponent.saturating_add(32) },
            1 => Positive { mantissa: (product >> 31) as u32, exponent: exponent.saturating_add(31) },
            _ => Positive::default(),
        }
    }

    /// Quotient; the largest number when `other` is zero.
    #[cold]
    #[inline]
    pub fn over(self, other: Self) -> Self {
        if other.mantissa == 0 {
            return Positive { mantissa: u32::MAX, exponent: i32::MAX / 4 };
        }
        let product = u64::from(self.mantissa) * u64::from(reciprocal(other.mantissa >> 1));
        Positive::new(product, self.exponent.saturating_sub(other.exponent).saturating_sub(62))
    }

    /// Sum.
    #[cold]
    #[inline]
    pub fn plus(self, other: Self) -> Self {
        let (large, small) = if self.exponent >= other.exponent { (self, other) } else { (other, self) };
        if small.mantissa == 0 {
            return large;
        }
        if large.mantissa == 0 {
            return small;
        }
        let lag = large.exponent.saturating_sub(small.exponent).min(63) as u32;
        let sum = (u64::from(large.mantissa) << 31) + ((u64::from(small.mantissa) << 31) >> (lag & 63));
        Positive::new(sum, large.exponent.saturating_sub(31))
    }

    /// `self · 2^bits`.
    #[inline]
    pub fn shifted(self, bits: i32) -> Self {
        Positive { mantissa: self.mantissa, exponent: self.exponent.saturating_add(bits) }
    }

    /// Square root.
    #[cold]
    #[inline]
    pub fn sqrt(self) -> Self {
        // An even exponent, and the radicand's top bit in one of the two highest places.
        let odd = self.exponent & 1;
        let radicand = u64::from(self.mantissa) << (32 - odd);
        Positive::new(u64::from(square_root(radicand)), self.exponent.saturating_sub(32 - odd) >> 1)
    }

    /// In units of 2^−`frac`, rounded, saturating.
    #[cold]
    #[inline]
    pub fn to_q(self, frac: u32) -> i32 {
        let shift = self.exponent.saturating_add(frac as i32);
        let value = match shift {
            // The mantissa alone is beyond 31 bits.
            0.. => self.mantissa,
            -32..0 => {
                let twice = self.mantissa >> (!shift & 31);
                (twice >> 1).wrapping_add(twice & 1)
            }
            _ => 0,
        };
        value.min(i32::MAX as u32) as i32
    }

    /// Exponent of the leading bit: the number lies in [2ⁿ, 2ⁿ⁺¹). Very negative for zero.
    #[inline]
    pub fn exponent_of_top(self) -> i32 {
        if self.mantissa == 0 { -1000 } else { self.exponent.saturating_add(31) }
    }

    /// Is it below `other`?
    #[inline]
    pub fn below(self, other: Self) -> bool {
        match (self.mantissa, other.mantissa) {
            (_, 0) => false,
            (0, _) => true,
            _ => (self.exponent, self.mantissa) < (other.exponent, other.mantissa),
        }
    }
}

/// ⌊√`radicand`⌋ of a radicand of 63 or 64 bits, or of zero: the upper half digit by digit, the lower half by one
/// division (P. Zimmermann, *Karatsuba square root*, INRIA report 3805, 1999).
#[inline]
fn square_root(radicand: u64) -> u32 {
    let (mut rest, mut root, mut bit) = ((radicand >> 32) as u32, 0u32, 1u32 << 30);
    while bit != 0 {
        let trial = root.wrapping_add(bit);
        root >>= 1;
        if rest >= trial {
            rest = rest.wrapping_sub(trial);
            root = root.wrapping_add(bit);
        }
        bit >>= 2;
    }
    // The rest is at most twice the root, so that half of (rest·2¹⁶ + next 16 bits) has 32 bits.
    let half = (rest << 15) | (radicand as u32 >> 17);
    let digit = half.checked_div(root).unwrap_or(0).min(0xFFFF);
    let found = (root << 16) | digit;
    // The digit is right or one too large.
    let exceeds = u64::from(found).wrapping_mul(u64::from(found)) > radicand;
    found.wrapping_sub(u32::from(exceeds))
}

/// ⌊2⁶¹ / `divisor`⌋ for `divisor` in [2³⁰, 2³¹): two digits of 16 bits, each estimated by a 32-bit division and then
/// corrected (D. E. Knuth, *The Art of Computer Programming* vol. 2, 4.3.1, algorithm D).
#[inline]
pub fn reciprocal(divisor: u32) -> u32 {
    let divisor = divisor.clamp(1 << 30, (1 << 31) - 1) << 1;
    let first = digit(1 << 30, divisor);
    // 2³⁰·2¹⁶ is a multiple of 2³²: modulo 2³² only the product is left.
    let rest = 0u32.wrapping_sub(first.wrapping_mul(divisor));
    (first << 16).wrapping_add(digit(rest, divisor))
}

/// ⌊`rest`·2¹⁶ / `divisor`⌋ for a divisor with its top bit set and a smaller rest.
#[inline]
fn digit(rest: u32, divisor: u32) -> u32 {
    let (high, low) = (divisor >> 16, divisor & 0xFFFF);
    let mut digit = rest / high;
    let mut left = rest.wrapping_sub(digit.wrapping_mul(high));
    // At most twice.
    while digit > 0xFFFF || digit.wrapping_mul(low) > (left << 16) {
        digit = digit.wrapping_sub(1);
        left = left.wrapping_add(high);
        if left > 0xFFFF {
            break;
        }
    }
    digit
}
