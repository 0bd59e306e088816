//! LDLᵀ factorisation of a small symmetric matrix in 32-bit integers, one column per call.
//!
//! The matrix is augmented by its right-hand side (last row), so one factorisation gives the factor, the transformed
//! right-hand side (last row of L) and the residual sum of squares (last pivot). Entries are scaled by powers of two so
//! that diagonals lie in [2²⁸, 2³⁰); by Cauchy–Schwarz every entry then fits. Column j of L holds as many fraction bits
//! as its pivot allows: |L_ij| ≤ √(A_ii/D_j). Golub & Van Loan, Matrix Computations, 4.1.2 (outer product form).

use super::positive::{Positive, reciprocal};
use crate::units::saturate;
use core::ops::Range;

/// Largest order, right-hand side included.
pub const MOST: usize = 7;
const WORDS: usize = MOST * (MOST + 1) / 2;
/// Fraction bits of the scaled unknowns.
pub const UNKNOWN_FRAC: u32 = 24;
/// A pivot below 2⁻¹⁸ of its diagonal is rounding noise: the data do not determine this unknown.
const LEAST_PIVOT: i32 = 1 << 11;
/// Residual sum of squares below which it is rounding noise.
const LEAST_RESIDUAL: i32 = 16;

/// A factorisation under way.
#[derive(Clone, Copy, Debug)]
pub struct Factor {
    order: usize,
    words: [i32; WORDS],
    exponents: [i8; MOST],
    fraction: [u8; MOST],
}

/// A gradient on its way through the factor.
#[derive(Clone, Copy, Debug, Default)]
pub struct Forward {
    solved: [i32; MOST],
    /// Exponent of the gradient's largest entry.
    top: i32,
}

impl Factor {
    /// An empty matrix of this order, right-hand side included.
    #[inline]
    pub fn new(order: usize) -> Self {
        Factor { order: order.min(MOST), words: [0; WORDS], exponents: [0; MOST], fraction: [0; MOST] }
    }

    /// Unknowns.
    #[inline]
    pub fn unknowns(&self) -> usize {
        self.order.saturating_sub(1)
    }

    /// Chooses the scale of row `i` from its diagonal. `false`: the diagonal is not positive.
    #[inline]
    pub fn scale(&mut self, i: usize, diagonal: i64) -> bool {
        let bits = 64i32.wrapping_sub(diagonal.leading_zeros() as i32);
        // Halved and rounded up, so that the scaled diagonal has 29 or 30 bits.
        if let Some(exponent) = self.exponents.get_mut(i) {
            *exponent = (bits.wrapping_sub(29) >> 1) as i8;
        }
        diagonal > 0
    }

    /// Sets entry (i, j), j ≤ i, after both rows have their scale.
    #[inline]
    pub fn set(&mut self, i: usize, j: usize, value: i64) {
        let shift = self.exponent(i).wrapping_add(self.exponent(j));
        let scaled = if shift > 0 {
            round_shift(value, shift as u32)
        } else {
            value.wrapping_shl(shift.unsigned_abs())
        };
        self.put(i, j, saturate(scaled));
    }

    /// Eliminates column `j` from these rows, the last ones first. `false`: the pivot is rounding noise.
    #[inline]
    pub fn column(&mut self, j: usize, rows: Range<usize>) -> bool {
        let pivot = self.at(j, j);
        if pivot < LEAST_PIVOT {
            return false;
        }
        let zeros = pivot.leading_zeros() - 1;
        let inverse = i64::from(reciprocal((pivot as u32) << zeros));
        let fraction = 29 - zeros.div_ceil(2);
        if let Some(place) = self.fraction.get_mut(j) {
            *place = fraction as u8;
        }
        // From the last row up: a row needs column j of the rows above it as it was.
        let rows = rows.start.max(j.wrapping_add(1))..rows.end.min(self.order);
        for i in rows.rev() {
            let entry = i64::from(self.at(i, j));
            let factor = saturate(round_shift(entry.wrapping_mul(inverse), 61 - zeros - fraction));
            self.eliminate(i, j, factor, fraction);
            self.put(i, j, factor);
        }
        true
    }

    /// Row i minus L_ij times column j, for the columns right of j.
    #[inline]
    fn eliminate(&mut self, i: usize, j: usize, factor: i32, fraction: u32) {
        let next = j.wrapping_add(1);
        let (mut at, mut other) = (place(i, next), place(next, j));
        for k in next..=i {
            let product = i64::from(factor).wrapping_mul(i64::from(self.word(other)));
            let value = self.word(at).saturating_sub(saturate(round_shift(product, fraction)));
            if let Some(word) = self.words.get_mut(at) {
                *word = value;
            }
            at = at.wrapping_add(1);
            other = other.wrapping_add(k).wrapping_add(1);
        }
    }

    /// Unknowns in scaled units, Q24, by back substitution.
    #[inline]
    pub fn unknowns_scaled(&self) -> [i32; MOST] {
        let last = self.unknowns();
        let mut unknowns = [0i32; MOST];
        for i in (0..last).rev() {
            let mut sum = i64::from(self.at(last, i)) << UNKNOWN_FRAC;
            let mut at = place(i.wrapping_add(1), i);
            for k in i.wrapping_add(1)..last {
                let unknown = unknowns.get(k).copied().unwrap_or(0);
                sum = sum.wrapping_sub(i64::from(self.word(at)).wrapping_mul(i64::from(unknown)));
                at = at.wrapping_add(k).wrapping_add(1);
            }
            let fraction = self.fraction.get(i).copied().unwrap_or(0);
            if let Some(unknown) = unknowns.get_mut(i) {
                *unknown = saturate(round_shift(sum, u32::from(fraction)));
            }
        }
        unknowns
    }

    /// Power of two that turns scaled unknown `i` into its own unit.
    #[inline]
    pub fn unknown_exponent(&self, i: usize) -> i32 {
        self.exponent(self.unknowns()).wrapping_sub(self.exponent(i))
    }

    /// A gradient g in the unknowns' own units, scaled.
    #[inline]
    pub fn load(&self, gradient: &[(Positive, bool); MOST]) -> Forward {
        let mut scaled = *gradient;
        let mut top = i32::MIN;
        for (i, (magnitude, _)) in scaled.iter_mut().enumerate().take(self.unknowns()) {
            *magnitude = magnitude.shifted(self.exponent(i).wrapping_neg());
            top = top.max(magnitude.exponent_of_top());
        }
        let mut solved = [0i32; MOST];
        for (entry, (magnitude, negative)) in solved.iter_mut().zip(scaled).take(self.unknowns()) {
            // 22 bits for the largest entry leave nine for growth.
            let magnitude = magnitude.shifted(22i32.wrapping_sub(top)).to_q(0);
            *entry = if negative { magnitude.wrapping_neg() } else { magnitude };
        }
        Forward { solved, top }
    }

    /// Solves L·z = g in place.
    #[inline]
    pub fn substitute(&self, forward: &mut Forward) {
        for i in 0..self.unknowns() {
            let (known, rest) = forward.solved.split_at_mut(i.min(MOST));
            let Some(entry) = rest.first_mut() else { continue };
            let mut sum = i64::from(*entry);
            for ((&known, &fraction), at) in known.iter().zip(&self.fraction).zip(place(i, 0)..) {
                if known != 0 {
                    let product = i64::from(self.word(at)).wrapping_mul(i64::from(known));
                    sum = sum.wrapping_sub(round_shift(product, u32::from(fraction)));
                }
            }
            *entry = saturate(sum);
        }
    }

    /// `sum` and the share that these unknowns have in gᵀ A⁻¹ g, in scaled units, of the gradient that was solved for.
    #[inline]
    pub fn variance(&self, forward: &Forward, mut sum: Positive, unknowns: Range<usize>) -> Positive {
        let end = unknowns.end.min(self.unknowns());
        for i in unknowns.start..end {
            let solved = forward.solved.get(i).copied().unwrap_or(0);
            if solved != 0 {
                let magnitude = Positive::of(solved, 0);
                let square = magnitude.times(magnitude);
                sum = sum.plus(square.over(Positive::of(self.at(i, i), 0)));
            }
        }
        sum
    }

    /// RSS · gᵀ A⁻¹ g from the sum over all unknowns: the variance of gᵀθ times the number of rows.
    #[inline]
    pub fn scaled_variance(&self, forward: &Forward, sum: Positive) -> Positive {
        // The sums' own scale, Q40, cancels between the residual and the inverse.
        sum.times(self.residual()).shifted(forward.top.wrapping_mul(2).wrapping_sub(4))
    }

    /// Residual sum of squares in the rows' own unit (they are Q20).
    #[inline]
    pub fn residual(&self) -> Positive {
        let last = self.unknowns();
        let pivot = Positive::of(self.at(last, last).max(LEAST_RESIDUAL), 0);
        pivot.shifted(self.exponent(last).wrapping_mul(2).wrapping_sub(40))
    }

    #[inline]
    fn exponent(&self, i: usize) -> i32 {
        self.exponents.get(i).map_or(0, |exponent| i32::from(*exponent))
    }

    #[inline]
    fn at(&self, i: usize, j: usize) -> i32 {
        self.word(place(i, j))
    }

    #[inline]
    fn word(&self, place: usize) -> i32 {
        self.words.get(place).copied().unwrap_or(0)
    }

    #[inline]
    fn put(&mut self, i: usize, j: usize, value: i32) {
        if let Some(word) = self.words.get_mut(place(i, j)) {
            *word = value;
        }
    }
}

/// Where entry (i, j), j ≤ i, of the lower triangle stands, by rows.
#[inline]
const fn place(i: usize, j: usize) -> usize {
    (i.wrapping_mul(i.wrapping_add(1)) / 2).wrapping_add(j)
}

/// `value / 2^bits`, rounded to nearest; `bits` is 0 … 63.
#[inline]
fn round_shift(value: i64, bits: u32) -> i64 {
    match bits {
        0 => value,
        _ => (value >> ((bits - 1) & 63)).wrapping_add(1) >> 1,
    }
}
