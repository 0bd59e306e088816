//! An input that cannot be used, or a servo that does not do what it is asked for: one sentence that names file, line,
//! field or cause, and the remedy.

use std::fmt::Display;
use strsim::{normalized_damerau_levenshtein, osa_distance};

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

    /// A file cannot be opened, or not be read to its end.
    pub fn unreadable(path: impl Display, why: impl Display) -> Self {
        Self::file(path, format!("cannot be read ({why}); check the path"))
    }

    /// One place in a file is unusable.
    pub fn at(path: impl Display, place: impl Display, what: impl Display) -> Self {
        Self(format!("{path}, {place}: {what}"))
    }

    /// One line of a file is unusable. Lines count from 1, the header included; 0: the line is not known.
    pub fn line(path: impl Display, line: u64, what: impl Display) -> Self {
        match line {
            0 => Self::file(path, what),
            line => Self::at(path, format!("line {line}"), what),
        }
    }

    /// All of these at once, a line each, if there are any.
    pub fn all(complaints: Vec<Self>) -> Result<(), Self> {
        let texts: Vec<String> = complaints.into_iter().map(|complaint| complaint.0).collect();
        if texts.is_empty() { Ok(()) } else { Err(Self(texts.join("\n"))) }
    }
}

/// Number of the line in which a byte of a text stands.
pub fn line_of(text: &str, place: usize) -> u64 {
    1 + text[..place.min(text.len())].matches('\n').count() as u64
}

/// Line of `key` in `[section]` of a TOML text; of the section where the key is empty; 0 where it is not there.
pub fn line_of_key(text: &str, section: &str, key: &str) -> u64 {
    let mut current = "";
    for (line, number) in text.lines().map(str::trim).zip(1..) {
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.split(']').next()) {
            current = name.trim();
            if current == section && key.is_empty() {
                return number;
            }
        }
        let name = line.split('=').next().unwrap_or("").trim().trim_matches('"');
        if current == section && name == key && !key.is_empty() {
            return number;
        }
    }
    0
}

/// Names at least so similar are near (1: equal, 0: nothing in common; Damerau's distance over the longer length).
/// Origin: of the known keys and effects no two different ones are misspelled into each other by a letter in six,
/// while words of other meaning (`no_load_rpm` and `R_ohm`: 0.36, `frictoin` and `drive_gain`: 0.2) lie far below.
const NEAR: f64 = 0.6;
/// Letters of a part of a name that is more than an accident. Chosen by judgement; not studied.
const PART: usize = 5;

/// The known name that is nearest to a mistyped one: one that begins with its letters up to an underscore, or with all of them, or
/// holds it; else the most similar one, if it is near.
pub fn nearest<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wrong = wrong.to_lowercase();
    let known: Vec<&str> = known.into_iter().collect();
    let begins = |name: &str| wrong.len() > 2 && name.starts_with(&wrong);
    let stem = |name: &str| name.split('_').next() == Some(&wrong);
    let holds = |name: &str| wrong.len() >= PART && name.contains(&wrong);
    let rules: [&dyn Fn(&str) -> bool; 3] = [&stem, &begins, &holds];
    let found = rules.iter().find_map(|rule| known.iter().find(|name| rule(&name.to_lowercase())));
    if let Some(found) = found {
        return Some(found);
    }
    let similar =
        known.into_iter().map(|name| (normalized_damerau_levenshtein(&wrong, &name.to_lowercase()), name));
    let most = similar.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (most.0 >= NEAR).then_some(most.1)
}

/// The same as the end of a sentence; empty if no known name is near.
pub fn nearest_hint<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(wrong, known).map(|near| format!("; the nearest is `{near}`")).unwrap_or_default()
}

/// Looks a word like a typing error of another: within one letter, in a long word two or three, changed, missing, too much
/// or exchanged with its neighbour? Two words that a user may well mean as they are differ by more.
pub fn mistyped(word: &str, meant: &str) -> bool {
    let (word, meant) = (word.to_lowercase(), meant.to_lowercase());
    word.len() > 2 && osa_distance(&word, &meant) <= 1 + word.len() / 8
}
