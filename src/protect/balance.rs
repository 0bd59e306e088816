//! The winding's voltage balance as a least-squares problem of three constants, in integers, a small step a look.
//!
//! ```text
//! ∫v dt = R·∫i dt + K·Δθ + L·Δi         columns: current, counts, rise of the current; right-hand side: voltage
//! ```
//!
//! The sums of products form the augmented normal matrix, the right-hand side in its last row. It is factorised by
//! [`crate::identify::ldl`], the identifier's own solver, whose last pivot is the squared voltage that stays unexplained.
//!
//! The rise is the difference of two single readings. Their noise is in the column, and a column with noise takes its
//! constant for too small and gives what is missing to the others (errors in variables): a winding of L/R = 0.2 s in slow
//! motion was once learned with 3 % of its inductance, 1.3 times its K and 0.7 times its R. So the noise, which is
//! measured, is taken off the square of the column, and while the rise does not stand out of it, nothing is believed.

use crate::identify::ldl::{Factor, Forward, MOST, UNKNOWN_FRAC};
use crate::identify::positive::Positive;

/// Columns: three constants and the right-hand side.
const COLUMNS: usize = 4;
const WORDS: usize = COLUMNS * (COLUMNS + 1) / 2;
/// The column of the inductance: the first that small motors do not determine.
const RISE: usize = 2;
/// Rows after which the sums are halved: what was learned long ago fades.
const LIFE: u32 = 1024;
/// Rows needed before the constants are solved for.
const ENOUGH: u32 = 24;
/// Rows between two solutions.
const INTERVAL: u32 = 8;
/// Share of the squared voltage that the equation may leave unexplained, 41/2¹⁴: 5 % rms.
const MOST_RESIDUAL: (i32, u32) = (41, 14);
/// Relative variance of R and K with which they are believed, 13/2¹⁵: 2 %, one standard deviation.
const MOST_VARIANCE: (i32, u32) = (13, 15);
/// The squares of the rise must be so many times their noise, as a shift: 4. What is not known of the noise is then a
/// small part of what is left.
const NOISE_SHIFT: u32 = 2;
/// Entries of the matrix that are set in one look.
const AT_ONCE: usize = 2;
/// The factor takes rows for Q20; these are whole numbers.
const ROW_BITS: i32 = 20;

/// The three constants, in voltages Q14, converter counts and ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Constants {
    /// R: voltage per converter count, Q16.
    pub resistance: i32,
    /// K: voltage · ticks per count, Q8.
    pub emf: i32,
    /// L: voltage · ticks per converter count, Q8.
    pub inductance: i32,
}

/// What is to be done next: each a small part of a look, some 150 instructions at most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    #[default]
    Idle,
    /// The scales of the columns.
    Scale,
    /// Up to two entries of row i, from column j on.
    Assemble(usize, usize),
    /// Column j of row i, the last row first.
    Column(usize, usize),
    Substitute,
    /// The constants.
    Unknowns,
    /// Is little enough left unexplained?
    Residual,
    /// How well R (0) and K (1) are known: gradient, forward substitution, variance, comparison.
    Gradient(usize),
    Forward(usize),
    Variance(usize),
    Doubt(usize),
}

/// Sums of products, and the solution under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    /// Lower triangle, row by row.
    words: [i64; WORDS],
    /// Share of noise in the squares of the rise.
    noise: i64,
    rows: u32,
    stage: Stage,
    factor: Factor,
    /// Without the inductance: its column was explained by the others.
    without: bool,
    scaled: [i32; MOST],
    found: Constants,
    unknowns: [Positive; 2],
    forward: Forward,
    variance: Positive,
}

impl Default for State {
    #[inline]
    fn default() -> Self {
        Self {
            words: [0; WORDS],
            noise: 0,
            rows: 0,
            stage: Stage::Idle,
            factor: Factor::new(COLUMNS),
            without: false,
            scaled: [0; MOST],
            found: Constants::default(),
            unknowns: [Positive::default(); 2],
            forward: Forward::default(),
            variance: Positive::default(),
        }
    }
}

impl State {
    /// Begins anew. What a solution leaves behind stays: the next one sets it before it is used.
    #[inline]
    pub fn forget(&mut self) {
        self.words = [0; WORDS];
        (self.noise, self.rows, self.stage) = (0, 0, Stage::Idle);
    }

    /// Adds one row: current, counts, rise, voltage, and the variance of the noise in the rise. Now and then a solution
    /// begins.
    #[inline]
    pub fn add(&mut self, row: [i32; COLUMNS], noise: i32) {
        let mut words = self.words.iter_mut();
        for (i, &left) in row.iter().enumerate() {
            for (&right, word) in row.iter().take(i.wrapping_add(1)).zip(&mut words) {
                *word = word.saturating_add(i64::from(left).wrapping_mul(i64::from(right)));
            }
        }
        self.noise = self.noise.saturating_add(i64::from(noise));
        self.rows = self.rows.saturating_add(1);
        if self.rows >= LIFE {
            self.rows /= 2;
            self.noise /= 2;
            self.words.iter_mut().for_each(|word| *word >>= 1);
        }
        if self.rows >= ENOUGH && self.rows.is_multiple_of(INTERVAL) {
            self.without = false;
            self.stage = Stage::Scale;
        }
    }

    /// Is a solution under way?
    #[inline]
    pub fn works(&self) -> bool {
        self.stage != Stage::Idle
    }

    /// One step of the solution; the constants when it ends and they are to be believed.
    #[inline]
    pub fn step(&mut self) -> Option<Constants> {
        self.stage = match self.stage {
            Stage::Idle => return None,
            Stage::Scale => self.scale(),
            Stage::Assemble(i, j) => self.assemble(i, j),
            Stage::Column(j, i) => self.column(j, i),
            Stage::Substitute => {
                self.scaled = self.factor.unknowns_scaled();
                Stage::Unknowns
            }
            Stage::Unknowns => self.unknowns(),
            Stage::Residual => self.residual(),
            Stage::Gradient(i) => {
                let mut gradient = [(Positive::default(), false); MOST];
                gradient[i & 1].0 = Positive::new(1, 0);
                self.forward = self.factor.load(&gradient);
                Stage::Forward(i)
            }
            Stage::Forward(i) => {
                self.factor.substitute(&mut self.forward);
                Stage::Variance(i)
            }
            Stage::Variance(i) => {
                self.variance = self.factor.variance(&self.forward, Positive::default(), 0..COLUMNS);
                Stage::Doubt(i)
            }
            Stage::Doubt(i) => match (self.known(i), i) {
                (false, _) => Stage::Idle,
                (true, 0) => Stage::Gradient(1),
                (true, _) => {
                    self.stage = Stage::Idle;
                    return Some(self.found);
                }
            },
        };
        None
    }

    /// The column of the sums behind a column of the system.
    #[inline]
    fn source(&self, column: usize) -> usize {
        if self.without && column >= RISE { column.wrapping_add(1) } else { column }
    }

    #[inline]
    fn order(&self) -> usize {
        COLUMNS.wrapping_sub(usize::from(self.without))
    }

    #[inline]
    fn word(&self, i: usize, j: usize) -> i64 {
        let (i, j) = (self.source(i), self.source(j));
        let place = (i.wrapping_mul(i.wrapping_add(1)) / 2).wrapping_add(j);
        let word = self.words.get(place).copied().unwrap_or(0);
        if (i, j) == (RISE, RISE) { word.saturating_sub(self.noise) } else { word }
    }

    /// Does the rise of the current stand out of its noise?
    #[inline]
    fn rises(&self) -> bool {
        self.words[RISE * (RISE + 1) / 2 + RISE] >> NOISE_SHIFT >= self.noise
    }

    #[inline]
    fn scale(&mut self) -> Stage {
        if !self.rises() {
            return Stage::Idle;
        }
        let order = self.order();
        self.factor = Factor::new(order);
        let mut fine = true;
        for i in 0..order {
            fine &= self.factor.scale(i, self.word(i, i));
        }
        match (fine, self.without) {
            (true, _) => Stage::Assemble(0, 0),
            (false, false) => self.leave_out_the_inductance(),
            (false, true) => Stage::Idle,
        }
    }

    #[inline]
    fn assemble(&mut self, i: usize, j: usize) -> Stage {
        let next = j.wrapping_add(AT_ONCE);
        for j in j..next.min(i.wrapping_add(1)) {
            self.factor.set(i, j, self.word(i, j));
        }
        if next <= i {
            Stage::Assemble(i, next)
        } else if i.wrapping_add(1) < self.order() {
            Stage::Assemble(i.wrapping_add(1), 0)
        } else {
            Stage::Column(0, self.order().wrapping_sub(1))
        }
    }

    #[inline]
    fn column(&mut self, j: usize, i: usize) -> Stage {
        let last = self.order().wrapping_sub(1);
        match self.factor.column(j, i..i.wrapping_add(1)) {
            true if i > j.wrapping_add(1) => Stage::Column(j, i.wrapping_sub(1)),
            true if j.wrapping_add(1) < last => Stage::Column(j.wrapping_add(1), last),
            true => Stage::Substitute,
            false if j == RISE => self.leave_out_the_inductance(),
            false => Stage::Idle,
        }
    }

    #[inline]
    fn leave_out_the_inductance(&mut self) -> Stage {
        self.without = true;
        Stage::Scale
    }

    /// A reversed encoder, or one that is not the motor's, gives no winding; nor does a drive with a law of its own.
    #[cold]
    #[inline(never)]
    fn unknowns(&mut self) -> Stage {
        let [resistance, emf, inductance, ..] = self.scaled;
        let own = |scaled: i32, i: usize| {
            Positive::of(scaled.max(0), UNKNOWN_FRAC).shifted(self.factor.unknown_exponent(i))
        };
        let unknowns = [own(resistance, 0), own(emf, 1)];
        let inductance = if self.without { 0 } else { own(inductance, RISE).to_q(8) };
        self.found = Constants { resistance: unknowns[0].to_q(16), emf: unknowns[1].to_q(8), inductance };
        self.unknowns = unknowns;
        if resistance > 0 && emf > 0 { Stage::Residual } else { Stage::Idle }
    }

    #[cold]
    #[inline(never)]
    fn residual(&self) -> Stage {
        let last = COLUMNS - 1;
        let whole = Positive::new(self.words[last * (last + 1) / 2 + last].unsigned_abs(), 0);
        let left = self.factor.residual().shifted(2 * ROW_BITS);
        let most = whole.times(Positive::of(MOST_RESIDUAL.0, MOST_RESIDUAL.1));
        if left.below(most) { Stage::Gradient(0) } else { Stage::Idle }
    }

    /// Is R (0) or K (1) known well enough?
    #[cold]
    #[inline(never)]
    fn known(&self, i: usize) -> bool {
        let variance = self.factor.scaled_variance(&self.forward, self.variance);
        let value = self.unknowns[i & 1];
        let freedom = u64::from(self.rows).saturating_sub(self.factor.unknowns() as u64);
        let most = value
            .times(value)
            .times(Positive::of(MOST_VARIANCE.0, MOST_VARIANCE.1))
            .times(Positive::new(freedom, 0));
        variance.below(most)
    }
}
