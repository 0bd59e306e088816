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

impl Positive {
    /// `value · 2^exponent`.
    pub fn new(value: u64, exponent: i32) -> Self {
        if value == 0 {
            return Positive::default();
        }
        let zeros = value.leading_zeros();
        let mantissa = ((value << zeros) >> 32) as u32;
        Positive {
            mantissa,
            exponent: exponent.saturating_add(32 - zeros as i32),
        }
    }

    /// |value| · 2^−`frac`.
    pub fn of(value: i32, frac: u32) -> Self {
        Positive::new(u64::from(value.unsigned_abs()), -(frac as i32))
    }

    /// Product.
    pub fn times(self, other: Self) -> Self {
        let product = u64::from(self.mantissa) * u64::from(other.mantissa);
        Positive::new(product, self.exponent.saturating_add(other.exponent))
    }

    /// Quotient; the largest number when `other` is zero.
    pub fn over(self, other: Self) -> Self {
        if other.mantissa == 0 {
            return Positive {
                mantissa: u32::MAX,
                exponent: i32::MAX / 4,
            };
        }
        let product = u64::from(self.mantissa) * u64::from(reciprocal(other.mantissa >> 1));
        Positive::new(
            product,
            self.exponent.saturating_sub(other.exponent).saturating_sub(62),
        )
    }

    /// Sum.
    pub fn plus(self, other: Self) -> Self {
        let (large, small) = if self.exponent >= other.exponent {
            (self, other)
        } else {
            (other, self)
        };
        if small.mantissa == 0 {
            return large;
        }
        if large.mantissa == 0 {
            return small;
        }
        let lag = large.exponent.saturating_sub(small.exponent).min(63) as u32;
        let sum = (u64::from(large.mantissa) << 31) + ((u64::from(small.mantissa) << 31) >> lag);
        Positive::new(sum, large.exponent.saturating_sub(31))
    }

    /// `self · 2^bits`.
    pub fn shifted(self, bits: i32) -> Self {
        Positive {
            mantissa: self.mantissa,
            exponent: self.exponent.saturating_add(bits),
        }
    }

    /// Square root, digit by digit.
    pub fn sqrt(self) -> Self {
        let odd = self.exponent & 1;
        let radicand = u64::from(self.mantissa) << (30 + odd);
        let mut root = 0u64;
        for bit in (0..32).rev() {
            let trial = root | (1 << bit);
            if trial * trial <= radicand {
                root = trial;
            }
        }
        Positive::new(root, (self.exponent - 30 - odd) / 2)
    }

    /// In units of 2^−`frac`, rounded, saturating.
    pub fn to_q(self, frac: u32) -> i32 {
        let shift = self.exponent.saturating_add(frac as i32);
        let value = match shift {
            0.. => u64::from(self.mantissa) << shift.min(31),
            -40..0 => (u64::from(self.mantissa) + (1 << (-shift - 1))) >> -shift,
            _ => 0,
        };
        value.min(i32::MAX as u64) as i32
    }

    /// Exponent of the leading bit: the number lies in [2ⁿ, 2ⁿ⁺¹). Very negative for zero.
    pub fn exponent_of_top(self) -> i32 {
        if self.mantissa == 0 {
            -1000
        } else {
            self.exponent.saturating_add(31)
        }
    }

    /// Is it below `other`?
    pub fn below(self, other: Self) -> bool {
        match (self.mantissa, other.mantissa) {
            (_, 0) => false,
            (0, _) => true,
            _ => (self.exponent, self.mantissa) < (other.exponent, other.mantissa),
        }
    }
}

/// 2⁶¹ / `divisor` for `divisor` in [2³⁰, 2³¹), error ≤ 2 LSB: a 32-bit division for the seed, two Newton steps.
pub fn reciprocal(divisor: u32) -> u32 {
    let divisor = divisor.clamp(1 << 30, (1 << 31) - 1);
    let seed = u32::MAX / (divisor >> 15);
    let mut inverse = i64::from(seed) << 14;
    for _ in 0..2 {
        let error = (1i64 << 61).wrapping_sub(i64::from(divisor).wrapping_mul(inverse));
        inverse = inverse.wrapping_add((error >> 31).wrapping_mul(inverse) >> 30);
    }
    inverse.clamp(0, i64::from(u32::MAX)) as u32
}
