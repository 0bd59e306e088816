//! How much of a long log was searched.

use serde::Serialize;

/// Rows of a long log on which effects were searched for; all others are simulated at the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Searched {
    /// Rows that were compared in the search.
    pub rows: usize,
    /// Rows of the log.
    pub of_rows: usize,
    /// Stretches that hold them.
    pub stretches: usize,
}

impl Searched {
    /// For the notes.
    pub fn sentence(&self) -> String {
        let Self { rows, of_rows, stretches } = self;
        format!(
            "the log is long: effects were searched for on {rows} of its {of_rows} rows, in {stretches} stretches; the gaps on held-out \
             data, where the error lies and the plots are those of all rows"
        )
    }
}
