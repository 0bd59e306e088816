//! From sums to numbers: assembles the normal equations, factorises them one column per tick, derives dead zone, gain,
//! time constant and their standard deviations.

use super::ldl::{Factor, Forward, MOST, UNKNOWN_FRAC};
use super::positive::Positive;
use super::regression::{Sums, place};
use super::spline::{HOPS_PER_BLOCK, Window};
use crate::units::{Direction, saturate};
use core::ops::Range;

/// Fraction bits of [`Solution`] coefficients (|coefficient| < 32).
pub const COEFFICIENT_FRAC: u32 = 26;
/// Fraction bits of dead zones.
pub const VOLTAGE_FRAC: u32 = 20;
/// Fraction bits of relative standard deviations.
pub const RELATIVE_FRAC: u32 = 20;

/// Which coefficients the directions share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Structure {
    /// One direction alone (0 positive, 1 negative): γ, β, α, δ.
    Single(Direction),
    /// Damping, gain and winding shared: γ₊, γ₋, β, α, δ. Fewest unknowns, for poor data.
    Common,
    /// Damping and winding shared, gain per direction: γ₊, γ₋, β₊, β₋, α, δ.
    Shared,
}

/// Unknowns that one tick scales, or whose share of a variance it sums up; the next tick does the rest.
const HALF: usize = 3;
/// Entries of the normal equations that one tick assembles.
const AT_ONCE: usize = 4;
/// Entries of a row from which one tick eliminates a column. Rows that have fewer are done at once: a row has as many as it
/// lies below the column.
const MOST_TOGETHER: usize = 3;
/// Not contained.
const NONE: u8 = u8::MAX;

impl Structure {
    /// Unknowns and right-hand side.
    #[inline]
    fn order(self) -> usize {
        match self {
            Structure::Single(_) => 5,
            Structure::Common => 6,
            Structure::Shared => 7,
        }
    }

    /// For each system column, the column of a row of `direction`; [`NONE`]: not contained.
    #[inline]
    fn columns(self, direction: Direction) -> &'static [u8; MOST] {
        match (self, direction) {
            (Structure::Single(own), _) if own == direction => &[0, 1, 2, 3, 4, NONE, NONE],
            (Structure::Single(_), _) => &[NONE; MOST],
            (Structure::Common, Direction::Positive) => &[0, NONE, 1, 2, 3, 4, NONE],
            (Structure::Common, _) => &[NONE, 0, 1, 2, 3, 4, NONE],
            (Structure::Shared, Direction::Positive) => &[0, NONE, 1, NONE, 2, 3, 4],
            (Structure::Shared, _) => &[NONE, 0, NONE, 1, 2, 3, 4],
        }
    }

    /// System columns of γ, β, α, δ of one direction.
    #[inline]
    fn unknowns(self, direction: Direction) -> [usize; 4] {
        let d = direction as usize;
        match self {
            Structure::Single(_) => [0, 1, 2, 3],
            Structure::Common => [d, 2, 3, 4],
            Structure::Shared => [d, 2 + d, 4, 5],
        }
    }
}

/// The coefficients of one direction, Q26.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coefficients {
    /// Dead zone times gain.
    pub gamma: i32,
    /// Voltage gain.
    pub beta: i32,
    /// Damping.
    pub alpha: i32,
    /// Winding.
    pub delta: i32,
}

/// What one solution says. Units: block, W₀, nominal supply.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Solution {
    /// Per direction; a single-direction solution fills only its own.
    pub coefficients: [Coefficients; 2],
    /// 1/β per direction, Q16.
    pub inverse_beta: [i32; 2],
    /// γ/β, nominal supply, Q20; negative when a load pulls.
    pub dead_zone: [i32; 2],
    /// Variance of one row's residual, as a squared voltage of nominal; neighbouring rows' overlap counted in.
    pub row_variance: Positive,
    /// Standard deviation of `dead_zone`, Q20.
    pub dead_zone_sigma: [i32; 2],
    /// β/α, mean of the directions.
    pub gain: Positive,
    /// Relative standard deviation of `gain`, Q20.
    pub gain_sigma: i32,
    /// 1/α, blocks: the sum of the linear part's time constants, because δ·j + a + α·w = α·(1 + s/α + s²·δ/α)·w.
    pub time_constant: Positive,
    /// Relative standard deviation of `time_constant`, Q20.
    pub time_constant_sigma: i32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    #[default]
    Idle,
    Scale,
    ScaleRest,
    /// From this entry on, row by row.
    Assemble(usize, usize),
    /// From the rows up to this one, the last ones first.
    Column(usize, usize),
    Substitute,
    Derive(Direction),
    DeriveCommon,
    Gradient(Derived),
    Forward(Derived),
    Variance(Derived),
    VarianceRest(Derived),
    PerRow(Derived),
    Deviation(Derived),
}

/// A number that follows from the unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Derived {
    DeadZone(Direction),
    Gain,
    TimeConstant,
}

/// How a call of [`Solver::step`] ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Nothing to do.
    Idle,
    /// More to come.
    Busy,
    /// Finished.
    Solved,
    /// The data do not determine the unknowns.
    Singular,
}

/// Solves in small steps, one a tick.
#[derive(Clone, Copy, Debug)]
pub struct Solver {
    stage: Stage,
    structure: Structure,
    rows: u32,
    factor: Factor,
    /// In scaled units, Q24.
    unknowns: [i32; MOST],
    forward: Forward,
    /// The variance of a derived number, as far as it has come.
    variance: Positive,
    solution: Solution,
}

impl Default for Solver {
    #[inline]
    fn default() -> Self {
        Solver {
            stage: Stage::Idle,
            structure: Structure::Common,
            rows: 0,
            factor: Factor::new(MOST),
            unknowns: [0; MOST],
            forward: Forward::default(),
            variance: Positive::default(),
            solution: Solution::default(),
        }
    }
}

impl Solver {
    /// Begins; the sums must not change while it [`reads`](Self::reads) them, and [`Progress::Solved`] comes after some 45
    /// calls.
    #[inline]
    pub fn start(&mut self, structure: Structure) {
        self.stage = Stage::Scale;
        self.structure = structure;
        self.factor = Factor::new(structure.order());
        self.solution = Solution::default();
    }

    /// Is it working?
    #[inline]
    pub fn busy(&self) -> bool {
        self.stage != Stage::Idle
    }

    /// Are the sums still being read?
    #[inline]
    pub fn reads(&self) -> bool {
        matches!(self.stage, Stage::Scale | Stage::ScaleRest | Stage::Assemble(..))
    }

    /// The structure of the last solution.
    #[inline]
    pub fn structure(&self) -> Structure {
        self.structure
    }

    /// The last solution; incomplete while it is working.
    #[inline]
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// Holds a solution that came from elsewhere.
    #[inline]
    pub fn hold(&mut self, solution: &Solution) {
        self.stage = Stage::Idle;
        self.solution = *solution;
    }

    /// The inverse gains of that solution.
    pub fn invert(&mut self) {
        let Solution { coefficients, inverse_beta, .. } = &mut self.solution;
        *inverse_beta = [coefficients[0].inverse_beta(), coefficients[1].inverse_beta()];
    }

    /// One step. `sums`: per direction, all sets that count together.
    #[cold]
    #[inline]
    pub fn step(&mut self, sums: &[&[Sums; 2]]) -> Progress {
        if self.stage == Stage::Idle {
            return Progress::Idle;
        }
        let next = self.next();
        let fine = self.work(sums);
        self.stage = if fine { next } else { Stage::Idle };
        match (fine, self.stage) {
            (false, _) => Progress::Singular,
            (true, Stage::Idle) => Progress::Solved,
            _ => Progress::Busy,
        }
    }

    /// What comes after this stage.
    #[inline]
    fn next(&self) -> Stage {
        let order = self.structure.order();
        match self.stage {
            Stage::Idle => Stage::Idle,
            Stage::Scale => Stage::ScaleRest,
            Stage::ScaleRest => Stage::Assemble(0, 0),
            Stage::Assemble(i, j) => match behind((i, j), AT_ONCE) {
                (i, j) if i < order => Stage::Assemble(i, j),
                _ => Stage::Column(0, order),
            },
            Stage::Column(j, end) => match first_row(j, end) {
                row if row > j.wrapping_add(1) => Stage::Column(j, row),
                _ if j.wrapping_add(2) < order => Stage::Column(j.wrapping_add(1), order),
                _ => Stage::Substitute,
            },
            Stage::Substitute => Stage::Derive(self.directions()[0]),
            Stage::Derive(direction) => match self.directions().last() {
                Some(&last) if last != direction => Stage::Derive(last),
                _ => Stage::DeriveCommon,
            },
            Stage::DeriveCommon => Stage::Gradient(Derived::DeadZone(self.directions()[0])),
            Stage::Gradient(which) => Stage::Forward(which),
            Stage::Forward(which) => Stage::Variance(which),
            Stage::Variance(which) => Stage::VarianceRest(which),
            Stage::VarianceRest(which) => Stage::PerRow(which),
            Stage::PerRow(which) => Stage::Deviation(which),
            Stage::Deviation(which) => self.after(which).map_or(Stage::Idle, Stage::Gradient),
        }
    }

    /// The work of one stage; false: the data do not determine the unknowns.
    #[inline]
    fn work(&mut self, sums: &[&[Sums; 2]]) -> bool {
        let order = self.structure.order();
        match self.stage {
            Stage::Idle => {}
            Stage::Scale => {
                let sets = sums.iter().flat_map(|set| set.iter());
                self.rows = sets.fold(0, |rows, sums| rows.saturating_add(sums.rows));
                return self.scale(sums, 0..HALF.min(order));
            }
            Stage::ScaleRest => return self.scale(sums, HALF..order),
            Stage::Assemble(i, j) => self.assemble((i, j), sums),
            Stage::Column(j, end) => return self.factor.column(j, first_row(j, end)..end),
            Stage::Substitute => self.unknowns = self.factor.unknowns_scaled(),
            Stage::Derive(direction) => return self.derive(direction),
            Stage::DeriveCommon => self.derive_common(),
            Stage::Gradient(which) => self.forward = self.factor.load(&self.gradient(which)),
            Stage::Forward(_) => self.factor.substitute(&mut self.forward),
            Stage::Variance(_) => {
                let none = Positive::default();
                self.variance = self.factor.variance(&self.forward, none, 0..HALF);
            }
            Stage::VarianceRest(_) => {
                self.variance = self.factor.variance(&self.forward, self.variance, HALF..MOST);
            }
            Stage::PerRow(_) => {
                let variance = self.factor.scaled_variance(&self.forward, self.variance);
                self.variance = self.per_row(variance);
            }
            Stage::Deviation(which) => self.deviation(which),
        }
        true
    }

    #[inline]
    fn scale(&mut self, sums: &[&[Sums; 2]], mut which: Range<usize>) -> bool {
        let columns = Direction::BOTH.map(|side| self.structure.columns(side));
        which.all(|i| self.factor.scale(i, entry(&columns, sums, i, i)))
    }

    /// [`AT_ONCE`] entries, row by row, this one first.
    #[inline]
    fn assemble(&mut self, (mut i, mut j): (usize, usize), sums: &[&[Sums; 2]]) {
        let (order, columns) =
            (self.structure.order(), Direction::BOTH.map(|side| self.structure.columns(side)));
        for _ in 0..AT_ONCE {
            if i >= order {
                return;
            }
            self.factor.set(i, j, entry(&columns, sums, i, j));
            (i, j) = behind((i, j), 1);
        }
    }

    /// Unknown `i` with its exponent.
    #[inline]
    fn unknown(&self, i: usize) -> (i32, i32) {
        (self.unknowns.get(i).copied().unwrap_or(0), self.factor.unknown_exponent(i))
    }

    /// Dead zone and coefficients of one direction. `false`: gain or damping came out negative, which no motor has.
    #[inline]
    fn derive(&mut self, direction: Direction) -> bool {
        let [gamma, beta, alpha, delta] = self.structure.unknowns(direction).map(|i| self.unknown(i));
        if beta.0 <= 0 || alpha.0 <= 0 {
            return false;
        }
        let ratio = magnitude(gamma).over(magnitude(beta)).to_q(VOLTAGE_FRAC);
        self.solution.dead_zone[direction] = if gamma.0 < 0 { ratio.wrapping_neg() } else { ratio };
        let q = |(value, exponent): (i32, i32)| {
            let q = magnitude((value, exponent)).to_q(COEFFICIENT_FRAC);
            if value < 0 { q.wrapping_neg() } else { q }
        };
        self.solution.coefficients[direction] =
            Coefficients { gamma: q(gamma), beta: q(beta), alpha: q(alpha), delta: q(delta) };
        self.solution.inverse_beta[direction] = self.solution.coefficients[direction].inverse_beta();
        true
    }

    /// What the directions have in common.
    #[inline]
    fn derive_common(&mut self) {
        let directions = self.directions();
        let [_, beta, alpha, _] = self.structure.unknowns(directions[0]).map(|i| self.unknown(i));
        let last = self.unknown(self.structure.unknowns(directions[directions.len() - 1])[1]);
        let beta = magnitude(beta).plus(magnitude(last)).shifted(-1);
        self.solution.gain = beta.over(magnitude(alpha));
        self.solution.row_variance = self.per_row(self.factor.residual()).over(beta.times(beta));
        self.solution.time_constant = Positive::new(1, 0).over(magnitude(alpha));
    }

    /// Directions that the structure solves for.
    #[inline]
    fn directions(&self) -> &'static [Direction] {
        match self.structure {
            Structure::Single(Direction::Positive) => &[Direction::Positive],
            Structure::Single(Direction::Negative) => &[Direction::Negative],
            _ => &Direction::BOTH,
        }
    }

    /// Derivatives of one derived number by the unknowns, with their signs.
    #[inline]
    fn gradient(&self, which: Derived) -> [(Positive, bool); MOST] {
        let directions = self.directions();
        let one = Positive::new(1, 0);
        let mut gradient = [(Positive::default(), false); MOST];
        let first = self.structure.unknowns(directions[0]);
        let last = self.structure.unknowns(directions[directions.len() - 1]);
        let alpha = Positive::of(self.solution.coefficients[directions[0]].alpha, COEFFICIENT_FRAC);
        match which {
            Derived::DeadZone(side) => {
                let dead_zone = self.solution.dead_zone[side];
                let beta = Positive::of(self.solution.coefficients[side].beta, COEFFICIENT_FRAC);
                let [gamma_at, beta_at, ..] = self.structure.unknowns(side);
                gradient[gamma_at] = (one.over(beta), false);
                gradient[beta_at] = (Positive::of(dead_zone, VOLTAGE_FRAC).over(beta), dead_zone > 0);
            }
            Derived::Gain => {
                let share = one.over(self.solution.gain.times(alpha)).shifted(-1);
                gradient[first[1]].0 = gradient[first[1]].0.plus(share);
                gradient[last[1]].0 = gradient[last[1]].0.plus(share);
                gradient[first[2]] = (one.over(alpha), true);
            }
            Derived::TimeConstant => gradient[first[2]] = (one.over(alpha), false),
        }
        gradient
    }

    /// Standard deviation of one derived number by linear propagation, from its gradient on its way.
    #[inline]
    fn deviation(&mut self, which: Derived) {
        let sigma = self.variance.sqrt();
        match which {
            Derived::DeadZone(side) => self.solution.dead_zone_sigma[side] = sigma.to_q(VOLTAGE_FRAC),
            Derived::Gain => self.solution.gain_sigma = sigma.to_q(RELATIVE_FRAC),
            Derived::TimeConstant => self.solution.time_constant_sigma = sigma.to_q(RELATIVE_FRAC),
        }
    }

    /// The derived number after `which`, if any. A single direction has one dead zone.
    #[inline]
    fn after(&self, which: Derived) -> Option<Derived> {
        match which {
            Derived::DeadZone(side) => match self.directions().last() {
                Some(&last) if last != side => Some(Derived::DeadZone(last)),
                _ => Some(Derived::Gain),
            },
            Derived::Gain => Some(Derived::TimeConstant),
            Derived::TimeConstant => None,
        }
    }

    /// Windows overlap by all but one hop: `HOPS_PER_BLOCK` of them count as one independent row.
    #[inline]
    fn per_row(&self, total: Positive) -> Positive {
        let rows = Positive::new(u64::from(self.rows.max(1)), 0);
        total.times(Positive::new(u64::from(HOPS_PER_BLOCK), 0)).over(rows)
    }
}

/// Entry (i, j), j ≤ i: in no direction do columns change their order.
#[inline]
fn entry(columns: &[&[u8; MOST]; 2], sums: &[&[Sums; 2]], i: usize, j: usize) -> i64 {
    let mut total = 0i64;
    for (direction, columns) in Direction::BOTH.into_iter().zip(columns) {
        let column = |i: usize| columns.get(i).filter(|&&column| column != NONE);
        let (Some(&p), Some(&q)) = (column(i), column(j)) else {
            continue;
        };
        let place = place(usize::from(p), usize::from(q));
        for set in sums {
            total = total.wrapping_add(set[direction].at(place));
        }
    }
    total
}

/// The entry so many behind this one in the lower triangle, row by row.
#[inline]
const fn behind((mut i, mut j): (usize, usize), entries: usize) -> (usize, usize) {
    j = j.wrapping_add(entries);
    while j > i {
        (i, j) = (i.wrapping_add(1), j.wrapping_sub(i).wrapping_sub(1));
    }
    (i, j)
}

/// The first of the rows up to `end` from which one tick eliminates column `j`.
#[inline]
const fn first_row(j: usize, end: usize) -> usize {
    let (last, first) = (end.wrapping_sub(1), j.wrapping_add(1));
    if last > j.wrapping_add(MOST_TOGETHER) { last } else { first }
}

#[inline]
fn magnitude((scaled, exponent): (i32, i32)) -> Positive {
    Positive::of(scaled, UNKNOWN_FRAC).shifted(exponent)
}

impl Solution {
    /// Voltage that a window's motion needs beyond the dead zone, (a + αw + δj)/β, mirrored for the negative direction,
    /// Q20 of nominal supply.
    #[inline]
    pub fn effective_voltage(&self, window: &Window, direction: Direction) -> i32 {
        let (c, inverse_beta) = (&self.coefficients[direction], self.inverse_beta[direction]);
        let torque = (i64::from(window.acceleration) << COEFFICIENT_FRAC)
            .wrapping_add(i64::from(c.alpha).wrapping_mul(i64::from(window.speed)))
            .wrapping_add(i64::from(c.delta).wrapping_mul(i64::from(window.jerk)))
            >> COEFFICIENT_FRAC;
        let voltage = torque.wrapping_mul(i64::from(inverse_beta)) >> INVERSE_FRAC;
        let voltage = saturate(voltage);
        if direction == Direction::Positive { voltage } else { voltage.saturating_neg() }
    }
}

impl Coefficients {
    /// 1/β, Q16.
    #[inline]
    pub fn inverse_beta(&self) -> i32 {
        let beta = Positive::of(self.beta, COEFFICIENT_FRAC);
        Positive::new(1, 0).over(beta).to_q(INVERSE_FRAC)
    }
}

/// Fraction bits of 1/β.
pub const INVERSE_FRAC: u32 = 16;
