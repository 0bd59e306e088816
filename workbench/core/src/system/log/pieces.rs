//! A run cut into pieces.

use super::Run;
use std::ops::Range;

/// Rows of a piece, and the number of its run.
pub type Piece = (Range<usize>, i64);

impl Run {
    /// The pieces as runs of their own. The columns are cut one after the other, so that no two copies of the run are there at once.
    pub(super) fn parted(mut self, pieces: &[Piece]) -> Vec<Self> {
        if let [(rows, id)] = pieces
            && *rows == (0..self.rows())
        {
            return vec![Self { id: *id, ..self }];
        }
        let mut runs: Vec<Self> = pieces.iter().map(|it| Self { id: it.1, ..Self::default() }).collect();
        cut(&mut self.t_s, pieces, &mut runs, |run, values| run.t_s = values);
        cut(&mut self.input, pieces, &mut runs, |run, values| run.input = values);
        cut(&mut self.bridge, pieces, &mut runs, |run, values| run.bridge = values);
        let set: [fn(&mut Self, Vec<f64>); 4] = [
            |run, values| run.position = Some(values),
            |run, values| run.speed = Some(values),
            |run, values| run.current_a = Some(values),
            |run, values| run.supply_v = Some(values),
        ];
        let measured = [self.position, self.speed, self.current_a, self.supply_v];
        for (column, set) in measured.into_iter().zip(set) {
            if let Some(mut values) = column {
                cut(&mut values, pieces, &mut runs, set);
            }
        }
        runs
    }

    /// These rows alone.
    pub fn keep(&mut self, rows: &[usize]) {
        if rows.len() == self.rows() {
            return;
        }
        let of = |values: &mut Vec<f64>| *values = rows.iter().map(|row| values[*row]).collect();
        [&mut self.t_s, &mut self.input].into_iter().for_each(of);
        self.bridge = rows.iter().map(|row| self.bridge[*row]).collect();
        let measured = [&mut self.position, &mut self.speed, &mut self.current_a, &mut self.supply_v];
        measured.into_iter().flatten().for_each(of);
    }

    /// The speed, or the change of the position from each row to the next, in whatever time the file counts.
    pub fn speeds(&self) -> Option<Vec<f64>> {
        let differences = |position: &Vec<f64>| {
            let rows = position.windows(2).zip(self.t_s.windows(2));
            rows.map(|(x, t)| (x[1] - x[0]) / (t[1] - t[0])).collect()
        };
        self.speed.clone().or_else(|| self.position.as_ref().map(differences))
    }

    /// The rows `start..end` as a run of their own.
    pub fn rows_between(&self, start: usize, end: usize, id: i64) -> Self {
        let cut = |values: &Option<Vec<f64>>| values.as_ref().map(|values| values[start..end].to_vec());
        Self {
            id,
            t_s: self.t_s[start..end].to_vec(),
            input: self.input[start..end].to_vec(),
            bridge: self.bridge[start..end].to_vec(),
            position: cut(&self.position),
            speed: cut(&self.speed),
            current_a: cut(&self.current_a),
            supply_v: cut(&self.supply_v),
        }
    }
}

fn cut<T: Copy>(values: &mut Vec<T>, pieces: &[Piece], runs: &mut [Run], set: impl Fn(&mut Run, Vec<T>)) {
    let values = std::mem::take(values);
    for (run, piece) in runs.iter_mut().zip(pieces) {
        set(run, values[piece.0.clone()].to_vec());
    }
}
