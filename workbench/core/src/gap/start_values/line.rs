//! The linear model that fits a log best: gain, time constant and a dry friction, without a model to begin with.
//!
//! A run is the response of a first-order lag to its input: ω(t) = ω₀ e^(−t/T) + gain · (u − u_f·sign ω) ∗ e^(−t/T)/T. For a given T
//! that is linear in gain, gain · u_f and a constant load ([`Motion`]), so T alone is searched for; and a limit of the input, because a
//! drive that clamps makes a response look quicker than it is.

use crate::gap::examine::motion::Motion;
use crate::gap::examine::stretch::PLAIN_FORCES;
use crate::gap::residual::largest;
use crate::system::log::{Dynamic, Table};
use nalgebra::{DMatrix, DVector};

/// Time constants that are tried, evenly in the logarithm, and limits, before the best is refined. Chosen by
/// judgement; not studied.
const TRIED: usize = 48;
/// Steps of the refinement: each narrows the interval to 0.62 of itself (golden section). Origin: 0.62²⁴ is 1e-5.
const REFINED: usize = 24;
/// The shortest time constant that is tried, in rows, and the longest, in lengths of the longest piece. A longer one
/// is an integrator, of which gain and time constant are known as their ratio alone. Chosen by judgement; not
/// studied.
const SHORTEST_ROWS: f64 = 0.3;
const LONGEST: f64 = 10.0;
/// A limit of the input is tried down to this share of its largest value, and must leave less than this share of what
/// is left without it: noise alone makes no such difference. Chosen by judgement; not studied.
const LEAST_LIMIT: f64 = 0.3;
const LIMITED: f64 = 0.7;
/// Limit and time constant are searched for in turn: after two rounds both lie within a step of the search. Chosen by
/// judgement; not studied.
const LIMIT_ROUNDS: usize = 2;
/// Settled speeds below this share of the largest one are a standstill. Chosen by judgement; not studied.
const STANDS: f64 = 0.01;

/// What the best linear model of a log says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Steady speed per unit of input.
    pub gain: f64,
    /// Time constant, s; `None`: a table of settled speeds does not show it.
    pub time_constant_s: Option<f64>,
    /// Share of the speed's variation (squared) that it leaves, 0 … 1.
    pub left: f64,
}

impl Line {
    /// The line of a record, and the one with a limit of the input where that is clearly better; `None` if nothing moves in it.
    pub fn of_record(log: &Dynamic) -> Option<[Self; 2]> {
        let motion = Motion::of(log)?.while_moving();
        let range =
            ((SHORTEST_ROWS * log.runs.first()?.sample_s()).ln(), (LONGEST * motion.longest_s()).ln());
        let at = |motion: &Motion, seconds: f64| {
            let fit = motion.fit_of(1.0 / seconds, PLAIN_FORCES);
            Self { gain: fit.slope * seconds, time_constant_s: Some(seconds), left: motion.left(&fit) }
        };
        let best = |motion: &Motion| at(motion, least(|ln_t| at(motion, ln_t.exp()).left, range).exp());
        let clamped = |limit: f64| motion.driven_by(|u| u.clamp(-limit, limit));
        let largest = motion.largest_input();
        let free = best(&motion);
        let mut limited = free;
        for _ in 0..LIMIT_ROUNDS {
            let seconds = limited.time_constant_s?;
            let limit = least(|limit| at(&clamped(limit), seconds).left, (LEAST_LIMIT * largest, largest));
            limited = best(&clamped(limit));
        }
        let better = if limited.left < LIMITED * free.left { limited } else { free };
        Some([free, better]).filter(|lines| lines.iter().all(|line| line.gain.abs() > 0.0))
    }

    /// The line of a table of settled speeds.
    pub fn of_table(table: &Table) -> Option<Self> {
        let fastest = largest(&table.omega_rad_s);
        let rows: Vec<usize> =
            (0..table.u_v.len()).filter(|k| table.omega_rad_s[*k].abs() > STANDS * fastest).collect();
        let speed: Vec<f64> = rows.iter().map(|k| table.omega_rad_s[*k]).collect();
        let columns = [
            rows.iter().map(|k| table.u_v[*k]).collect(),
            speed.iter().map(|omega| -omega.signum()).collect(),
        ];
        let (numbers, left) = solved(&columns, &speed)?;
        Some(Self { gain: numbers[0], time_constant_s: None, left }).filter(|line| line.gain.abs() > 0.0)
    }

    /// Acceleration per unit of input, rad/s² or m/s².
    pub fn acceleration_per_input(&self) -> Option<f64> {
        self.time_constant_s.map(|time_constant_s| self.gain / time_constant_s)
    }
}

/// Least squares: the weights of the columns, and the share of the aim's square that they leave.
fn solved(columns: &[Vec<f64>], aim: &[f64]) -> Option<(DVector<f64>, f64)> {
    let aim = DVector::from_column_slice(aim);
    let square = aim.norm_squared();
    if aim.len() < columns.len() || square <= 0.0 {
        return None;
    }
    let matrix = DMatrix::from_fn(aim.len(), columns.len(), |row, column| columns[column][row]);
    // Of the normal equations: three numbers from thousands of rows. A column of zeros has no weight.
    let normal = matrix.tr_mul(&matrix);
    let weights = normal.clone().pseudo_inverse(1e-12 * normal.norm()).ok()? * matrix.tr_mul(&aim);
    let left = (aim - matrix * &weights).norm_squared() / square;
    left.is_finite().then_some((weights, left))
}

/// Where a function is least between two points: the best of [`TRIED`], refined.
fn least(value: impl Fn(f64) -> f64, (low, high): (f64, f64)) -> f64 {
    let step = (high - low) / TRIED as f64;
    let tried = (0..=TRIED).map(|k| low + step * k as f64).map(|at| (value(at), at));
    let best = tried.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(low, |best| best.1);
    golden(value, best - step, (best + step).min(high))
}

/// The least value of a function between two points (Kiefer, Proceedings of the AMS 4, 1953).
fn golden(value: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let share = 0.5 * (3.0 - 5f64.sqrt());
    for _ in 0..REFINED {
        let (a, b) = (low + share * (high - low), high - share * (high - low));
        if value(a) < value(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}
