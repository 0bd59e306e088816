//! An input that cannot be used, or a servo that does not do what it is asked for: one sentence that names file, line,
//! field or cause, and the remedy.

use std::fmt::Display;
use strsim::osa_distance;

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

    /// All of these at once, if there are any.
    pub fn all(complaints: Vec<Self>) -> Result<(), Self> {
        let texts: Vec<String> = complaints.into_iter().map(|complaint| complaint.0).collect();
        match texts.is_empty() {
            true => Ok(()),
            false => Err(Self(texts.join("; "))),
        }
    }
}

/// The known name that is nearest to a mistyped one: one that begins with it, else by edit distance, if any is near.
pub fn nearest<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wrong = wrong.to_lowercase();
    let known: Vec<&str> = known.into_iter().collect();
    if let Some(longer) = known.iter().find(|name| wrong.len() > 2 && name.to_lowercase().starts_with(&wrong))
    {
        return Some(longer);
    }
    let (distance, name) = known
        .into_iter()
        .map(|name| (osa_distance(&wrong, &name.to_lowercase()), name))
        .min_by_key(|pair| pair.0)?;
    (distance <= name.len().max(wrong.len()) * 2 / 3).then_some(name)
}

/// Looks a word like a typing error of another: within one letter, in a long word two or three, changed, missing, too much
/// or exchanged with its neighbour? Two words that a user may well mean as they are differ by more.
pub fn mistyped(word: &str, meant: &str) -> bool {
    let (word, meant) = (word.to_lowercase(), meant.to_lowercase());
    word.len() > 2 && osa_distance(&word, &meant) <= 1 + word.len() / 8
}
