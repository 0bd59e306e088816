//! Information form of the regression: sums of products, nothing that could wind up or lose definiteness.
//!
//! Model of one direction (rows of the negative direction are mirrored, so all coefficients are positive):
//!
//! ```text
//! a = −α·w + β·u − γ − δ·j          d = γ/β   K = β/α   τ = 1/α   (blocks, W₀, nominal supply)
//! ```
//!
//! α = NT/τ from damping, β from the gain, γ from friction or an input dead zone, δ ≈ τₑ/NT from the winding.
//! The acceleration is the regressand: it carries the encoder's quantisation, which then biases nothing. Without the
//! jerk column an electrical time constant of 1 ms costs several per cent of dead zone.

use super::spline::{ROW_FRAC, Window};
use crate::units::Direction;

/// Coefficients per direction: γ, β, α, δ in this order (the constant first keeps the factors small).
pub const COEFFICIENTS: usize = 4;
/// Coefficients and the regressand.
pub const COLUMNS: usize = COEFFICIENTS + 1;
const WORDS: usize = COLUMNS * (COLUMNS + 1) / 2;
/// Rows after which the sums are halved: 2²⁰ rows of |column| < 2 keep every word below 2⁶³.
const MOST_ROWS: u32 = 1 << 20;

/// One equation: columns (−1, u, −w, −j) and a, Q20, mirrored for the negative direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row(pub [i32; COLUMNS]);

impl Row {
    /// The equation that a window gives for a direction (0 positive, 1 negative).
    #[inline]
    pub fn new(window: &Window, direction: Direction) -> Self {
        let mirror = |value: i32| {
            if direction == Direction::Positive { value } else { value.saturating_neg() }
        };
        Row([
            -(1 << ROW_FRAC),
            mirror(window.voltage),
            mirror(window.speed).saturating_neg(),
            mirror(window.jerk).saturating_neg(),
            mirror(window.acceleration),
        ])
    }

    /// Speed in the direction of the row, Q20 of W₀.
    #[inline]
    pub fn speed(&self) -> i32 {
        self.0[2].saturating_neg()
    }
}

/// Sums of products of rows, Q40, lower triangle by rows; and what speeds they covered.
#[derive(Clone, Copy, Debug)]
pub struct Sums {
    words: [i64; WORDS],
    /// Rows summed.
    pub rows: u32,
    /// Lowest speed among them, Q20 of W₀.
    pub slowest: i32,
    /// Highest speed among them, Q20 of W₀.
    pub fastest: i32,
}

/// Where the sum of column `i` times column `j` stands, j ≤ i.
#[inline]
pub const fn place(i: usize, j: usize) -> usize {
    (i.wrapping_mul(i.wrapping_add(1)) / 2).wrapping_add(j)
}

impl Default for Sums {
    #[inline]
    fn default() -> Self {
        Sums { words: [0; WORDS], rows: 0, slowest: i32::MAX, fastest: 0 }
    }
}

impl Sums {
    /// Adds one row.
    #[inline]
    pub fn add(&mut self, row: &Row) {
        let mut words = self.words.iter_mut();
        for (i, &left) in row.0.iter().enumerate() {
            for (&right, word) in row.0[..=i].iter().zip(&mut words) {
                *word = word.wrapping_add(i64::from(left) * i64::from(right));
            }
        }
        self.rows = self.rows.saturating_add(1);
        self.slowest = self.slowest.min(row.speed());
        self.fastest = self.fastest.max(row.speed());
        if self.rows >= MOST_ROWS {
            self.halve();
        }
    }

    /// Σ of two columns' products, Q40, from its [`place`].
    #[inline]
    pub fn at(&self, place: usize) -> i64 {
        self.words.get(place).copied().unwrap_or(0)
    }

    /// Half the weight of everything so far.
    #[inline]
    pub fn halve(&mut self) {
        for word in &mut self.words {
            *word >>= 1;
        }
        self.rows /= 2;
    }
}
