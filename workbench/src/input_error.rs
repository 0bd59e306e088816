//! An input that cannot be used, or a servo that does not do what it is asked for: one sentence that names file, line,
//! field or cause, and the remedy.

use std::fmt::Display;

/// Why an input is unusable.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct InputError(pub String);

/// The input was usable, but the servo did not do what it was asked for: one sentence that says why.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NotDone(pub String);

impl InputError {
    /// A whole file is unusable.
    pub fn file(path: impl Display, what: impl Display) -> Self {
        Self(format!("{path}: {what}"))
    }

    /// One line of a file is unusable. Lines count from 1, the header included.
    pub fn line(path: impl Display, line: u64, what: impl Display) -> Self {
        Self(format!("{path}, line {line}: {what}"))
    }
}

/// The known name that is nearest to a mistyped one: one that begins with it, else by edit distance, if any is near.
pub fn nearest<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wrong = wrong.to_lowercase();
    let known: Vec<&str> = known.into_iter().collect();
    if let Some(longer) = known
        .iter()
        .find(|name| wrong.len() > 2 && name.to_lowercase().starts_with(&wrong))
    {
        return Some(longer);
    }
    let (distance, name) = known
        .into_iter()
        .map(|name| (edit_distance(&wrong, &name.to_lowercase()), name))
        .min_by_key(|pair| pair.0)?;
    (distance <= name.len().max(wrong.len()) * 2 / 3).then_some(name)
}

/// Levenshtein's distance: insertions, deletions and substitutions that turn `a` into `b`.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}
