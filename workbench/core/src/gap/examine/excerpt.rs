//! Which rows of a record are examined, and where its shaft is.

use std::ops::Range;

/// Rows of a run that are looked at: of a longer one as many, in pieces spread over it. A budget of computing time,
/// chosen by judgement.
const LOOKED_AT: usize = 200_000;
/// Pieces of a longer run. A budget of computing time, chosen by judgement.
const PIECES: usize = 16;

/// Which of so many rows are looked at.
pub fn looked_at(rows: usize) -> Vec<Range<usize>> {
    let length = LOOKED_AT / PIECES;
    match rows <= LOOKED_AT {
        true => std::iter::once(0..rows).collect(),
        false => {
            (0..PIECES).map(|k| k * (rows - length) / (PIECES - 1)).map(|from| from..from + length).collect()
        }
    }
}

/// Where the shaft is, if only its speed was logged.
pub fn integrated(time: &[f64], speed: &[f64]) -> Vec<f64> {
    let mut place = 0.0;
    let mut places = vec![0.0];
    for row in 1..time.len() {
        place += 0.5 * (speed[row] + speed[row - 1]) * (time[row] - time[row - 1]);
        places.push(place);
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_run_is_looked_at_from_its_first_row_to_its_last() {
        assert_eq!(looked_at(LOOKED_AT).len(), 1);
        let pieces = looked_at(10_000_000);
        assert_eq!((pieces[0].start, pieces[PIECES - 1].end), (0, 10_000_000));
        assert_eq!(pieces.iter().map(Range::len).sum::<usize>(), LOOKED_AT);
    }
}
