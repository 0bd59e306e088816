//! The linear model that fits a log best: gain, time constant and a dry friction, without a model to begin with.
//!
//! A run is the response of a first-order lag to its input: ω(t) = ω₀ e^(−t/T) + gain · (u − u_f·sign ω) ∗ e^(−t/T)/T. For a given T
//! that is linear in gain, gain · u_f and a constant load, so T alone is searched for; and a limit of the input, because a drive that
//! clamps makes a response look quicker than it is.

use crate::gap::residual::largest;
use crate::system::log::{Dynamic, Run, Table};
use nalgebra::{DMatrix, DVector};
use servo::axis::Bridge;

/// Time constants that are tried, evenly in the logarithm, and limits, before the best is refined.
const TRIED: usize = 48;
/// Steps of the refinement: each narrows the interval to 0.62 of itself (golden section).
const REFINED: usize = 24;
/// The shortest time constant that is tried, in rows, and the longest, in lengths of the longest piece. A longer one is an
/// integrator, of which gain and time constant are known as their ratio alone.
const SHORTEST_ROWS: f64 = 0.3;
const LONGEST: f64 = 10.0;
/// A limit of the input is tried down to this share of its largest value, and must leave less than this share of what is left without it:
/// noise alone makes no such difference.
const LEAST_LIMIT: f64 = 0.3;
const LIMITED: f64 = 0.7;
/// Limit and time constant are searched for in turn: after two rounds both lie within a step of the search.
const LIMIT_ROUNDS: usize = 2;
/// A speed below this share of the largest one, at two rows in succession, is a standstill: friction holds what the input drives.
const STANDS: f64 = 0.01;
/// A piece of a run needs so many rows to show a time constant.
const ROWS: usize = 10;
/// Rows at most: a start value needs no more.
const MOST_ROWS: usize = 20_000;
/// A position is differenced over a 200th of the log, over 50 rows at most: its steps then hide no motion.
const SPAN: (usize, usize) = (200, 50);

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
        let pieces: Vec<Piece> = log.runs.iter().flat_map(pieces).collect();
        let longest = pieces.iter().map(Piece::duration).fold(0.0, f64::max);
        let sample = log.runs.first()?.sample_s();
        if pieces.is_empty() || sample <= 0.0 {
            return None;
        }
        let range = ((SHORTEST_ROWS * sample).ln(), (LONGEST * longest).ln());
        let best = |limit: f64| {
            let ln_t = least(|ln_t| left(&pieces, ln_t.exp(), limit), range);
            fitted(&pieces, ln_t.exp(), limit)
        };
        let free = best(f64::INFINITY)?;
        let largest = pieces.iter().map(|piece| largest(&piece.input)).fold(0.0, f64::max);
        let mut limited = free;
        for _ in 0..LIMIT_ROUNDS {
            let seconds = limited.time_constant_s?;
            let limit = least(|limit| left(&pieces, seconds, limit), (LEAST_LIMIT * largest, largest));
            limited = best(limit)?;
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

/// Rows of a run in which the bridge drives.
struct Piece {
    time: Vec<f64>,
    /// Input, and the same where friction holds the shaft: 0.
    input: Vec<f64>,
    /// Direction of motion; 0 at standstill.
    direction: Vec<f64>,
    /// The speed, from the row itself to `span` rows later.
    speed: Vec<f64>,
    span: usize,
}

fn pieces(run: &Run) -> Vec<Piece> {
    let rows = run.rows().min(MOST_ROWS);
    let driven = |k: &usize| run.bridge[*k] != Bridge::Open;
    let mut found = Vec::new();
    let mut from = 0;
    while let Some(first) = (from..rows).find(driven) {
        let end = (first..rows).find(|k| !driven(k)).unwrap_or(rows);
        found.extend(Piece::of(run, first, end));
        from = end;
    }
    found
}

impl Piece {
    fn of(run: &Run, from: usize, to: usize) -> Option<Self> {
        let rows = to - from;
        let span = if run.speed.is_some() { 0 } else { (rows / SPAN.0).clamp(1, SPAN.1) };
        if rows < ROWS + span {
            return None;
        }
        let time = run.t_s[from..to].to_vec();
        let speed: Vec<f64> = match (&run.speed, &run.position) {
            (Some(speed), _) => speed[from..to].to_vec(),
            (None, Some(position)) => {
                let mean = |k: usize| (position[k + span] - position[k]) / (run.t_s[k + span] - run.t_s[k]);
                (from..to - span).map(mean).collect()
            }
            (None, None) => return None,
        };
        let slow = STANDS * largest(&speed);
        let moves = |k: usize| {
            let here = speed.get(k).or(speed.last()).is_some_and(|omega| omega.abs() > slow);
            here || speed.get(k + 1).is_some_and(|omega| omega.abs() > slow)
        };
        let moving: Vec<bool> = (0..rows).map(moves).collect();
        let at = |k: usize| speed[k.min(speed.len() - 1)];
        let direction = |k: usize| if moving[k] { at(k).signum() } else { 0.0 };
        let input = |k: usize| if moving[k] { run.input[from + k] } else { 0.0 };
        Some(Self {
            input: (0..rows).map(input).collect(),
            direction: (0..rows).map(direction).collect(),
            time,
            speed,
            span,
        })
    }

    fn duration(&self) -> f64 {
        self.time[self.time.len() - 1] - self.time[0]
    }

    /// What the speed's readings show of the response to a held signal.
    fn response(&self, signal: impl Fn(usize) -> f64, start: f64, time_constant_s: f64) -> Vec<f64> {
        let (mut state, mut way) = (start, 0.0);
        let (mut states, mut ways) = (vec![state], vec![way]);
        for k in 0..self.time.len() - 1 {
            let (step, aim) = (self.time[k + 1] - self.time[k], signal(k));
            let next = aim + (state - aim) * (-step / time_constant_s).exp();
            way += aim * step + time_constant_s * (state - next);
            state = next;
            states.push(state);
            ways.push(way);
        }
        match self.span {
            0 => states,
            span => {
                let mean = |k: usize| (ways[k + span] - ways[k]) / (self.time[k + span] - self.time[k]);
                (0..self.speed.len()).map(mean).collect()
            }
        }
    }
}

fn left(pieces: &[Piece], time_constant_s: f64, limit: f64) -> f64 {
    fitted(pieces, time_constant_s, limit).map_or(f64::INFINITY, |line| line.left)
}

/// The best gain for a time constant and a limit of the input.
fn fitted(pieces: &[Piece], time_constant_s: f64, limit: f64) -> Option<Line> {
    let all = |part: &dyn Fn(&Piece) -> Vec<f64>| pieces.iter().flat_map(part).collect::<Vec<f64>>();
    let columns = [
        all(&|piece| piece.response(|k| piece.input[k].clamp(-limit, limit), 0.0, time_constant_s)),
        all(&|piece| piece.response(|k| -piece.direction[k], 0.0, time_constant_s)),
        all(&|piece| piece.response(|k| piece.direction[k].abs(), 0.0, time_constant_s)),
    ];
    let rest = all(&|piece| {
        let decay = piece.response(|_| 0.0, piece.speed[0], time_constant_s);
        piece.speed.iter().zip(decay).map(|(speed, decay)| speed - decay).collect()
    });
    let (numbers, left) = solved(&columns, &rest)?;
    let speed = all(&|piece| piece.speed.clone());
    let variation = DVector::from_vec(speed).norm_squared();
    let left = left * DVector::from_vec(rest).norm_squared() / variation.max(f64::MIN_POSITIVE);
    Some(Line { gain: numbers[0], time_constant_s: Some(time_constant_s), left })
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
