//! One run on its grid.

use super::preheat::Preheat;
use super::probe::Probes;
use crate::system::log::Run;
use servo::axis::Bridge;

/// One run made ready.
#[derive(Clone, Debug, Default)]
pub struct GridRun {
    /// Number of the run in the log.
    pub id: i64,
    /// Index of the log: 0 the log itself, 1 … the hold-outs.
    pub log: usize,
    /// Start of each block and the end of the last, s.
    pub time: Vec<f64>,
    /// Bridge mode of each block.
    pub bridge: Vec<Bridge>,
    /// First row of each block, and one past the last row of all.
    pub first_row: Vec<u32>,
    /// Start of each row and the end of the last, s.
    pub row_time: Vec<f64>,
    /// Input of each row.
    pub input: Vec<f64>,
    /// Shaft position at the grid's points: measured, or the integral of the measured speed.
    pub position: Vec<f64>,
    /// Speed at the start.
    pub start_speed: f64,
    /// Uncertainty of the speed at the start; 0: it starts at rest.
    pub start_sigma: f64,
    /// Time from the start of the run in the log to the start of this one, s: of a stretch of a long log.
    pub since_s: f64,
    /// What happened in that time.
    pub preheat: Option<Preheat>,
    /// The compared speed.
    pub speed: Probes,
    /// The compared current; empty if there is none.
    pub current: Probes,
}

impl GridRun {
    /// A logged run as it is: each row a block, from rest.
    pub fn of_rows(run: &Run) -> Self {
        let rows = run.rows() - 1;
        Self {
            time: run.t_s.clone(),
            row_time: run.t_s.clone(),
            bridge: run.bridge[..rows].to_vec(),
            input: run.input[..rows].to_vec(),
            first_row: (0..=rows as u32).collect(),
            ..Self::default()
        }
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.bridge.len()
    }
}

/// The longest way between two positions of one run of the log, rad or m.
pub(super) fn travel(runs: &[GridRun]) -> f64 {
    let range = |run: &GridRun| {
        let low = run.position.iter().copied().fold(f64::INFINITY, f64::min);
        let high = run.position.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (high - low).max(0.0)
    };
    runs.iter().filter(|run| run.log == 0).map(range).fold(0.0, f64::max)
}
