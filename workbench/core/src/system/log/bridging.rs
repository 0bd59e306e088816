//! Rows with holes: empty cells and NaN. A measurement that lacks for a moment is interpolated, a row without time or input
//! is left out and the record is cut there.

use super::Run;

/// Share of the rows that may have holes. More is no mishap of a logger but a column that is not there. Chosen by
/// judgement (decision 0280); not studied.
pub const MOST: f64 = 0.02;
/// Rows in a row that are interpolated; a longer hole hides motion. Chosen by judgement (decision 0280); not studied.
const LONGEST: usize = 3;

/// What was bridged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bridged {
    /// Rows that stay.
    pub kept: Vec<bool>,
    /// Rows with an interpolated measurement.
    pub interpolated: usize,
    /// Rows that are left out.
    pub removed: usize,
}

impl Bridged {
    /// What was done, where something was. `kept` of the `rows` of the file are in the log.
    pub fn sentence(&self, rows: usize, kept: usize) -> Option<String> {
        let holes = self.interpolated + self.removed;
        let cut = match rows - kept {
            0 => String::new(),
            gone => format!(", {gone} are left out and the record is cut there"),
        };
        (holes > 0).then(|| {
            format!("{holes} of {rows} rows have empty cells: {} are interpolated{cut}.", self.interpolated)
        })
    }
}

/// The time, and what may be interpolated over it.
pub fn measured(run: &mut Run) -> (&[f64], impl Iterator<Item = &mut Vec<f64>>) {
    let Run { t_s, position, speed, current_a, supply_v, .. } = run;
    (t_s, [position, speed, current_a, supply_v].into_iter().flatten())
}

/// The rows with a hole; `lost` are those without time, input, bridge or run.
pub fn holes(run: &Run, lost: &[bool]) -> Vec<usize> {
    let measured = || [&run.position, &run.speed, &run.current_a, &run.supply_v].into_iter().flatten();
    let hole = |row: &usize| lost[*row] || measured().any(|column| column[*row].is_nan());
    (0..run.rows()).filter(hole).collect()
}

/// Interpolates over time what lacks for up to three rows, and tells which rows stay.
pub fn bridge(run: &mut Run, lost: &[bool], id: impl Fn(usize) -> f64) -> Bridged {
    let holes = holes(run, lost);
    let mut bridged = Bridged { kept: vec![true; run.rows()], interpolated: 0, removed: 0 };
    for block in holes.chunk_by(|a, b| a + 1 == *b) {
        let (from, to) = (block[0], block[block.len() - 1]);
        let inside = from > 0 && to + 1 < run.rows() && id(from - 1) == id(to + 1);
        if inside && block.len() <= LONGEST && !lost[from..=to].contains(&true) {
            let (t_s, measured) = measured(run);
            measured.for_each(|column| fill(t_s, column, from - 1, to + 1));
            bridged.interpolated += block.len();
        } else {
            bridged.kept[from..=to].fill(false);
            bridged.removed += block.len();
        }
    }
    bridged
}

/// Fills what lacks between two rows, evenly over time.
pub fn fill(t_s: &[f64], column: &mut [f64], from: usize, to: usize) {
    for row in from + 1..to {
        if column[row].is_nan() {
            let share = (t_s[row] - t_s[from]) / (t_s[to] - t_s[from]);
            column[row] = column[from] + share * (column[to] - column[from]);
        }
    }
}
