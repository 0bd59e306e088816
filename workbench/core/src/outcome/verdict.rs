//! What the workflow concluded, and how sure it is.

use serde::Serialize;

/// What the workflow concluded. The first that holds, in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The files are at fault: a unit, a sign, a column, a key, a record of another motor.
    Data,
    /// Nothing could be tested: the log does not move enough.
    #[default]
    InsufficientExcitation,
    /// Something is missing that the library does not know.
    Unexplained,
    /// Several explanations fit equally; an experiment tells them apart.
    Tie,
    /// The missing effects are named.
    Named,
    /// Simulation and data agree to the noise.
    NothingMissing,
}

impl Verdict {
    /// What holds where something is left, explanations are tied, and effects are named.
    pub fn of(left: bool, tied: bool, named: bool) -> Self {
        match (left, tied, named) {
            (true, ..) => Self::Unexplained,
            (_, true, _) => Self::Tie,
            (.., true) => Self::Named,
            _ => Self::NothingMissing,
        }
    }
}

/// How sure the verdict is. It says more than [`Verdict`]: a verdict of *named* has three grades.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Grade {
    /// The files are at fault.
    Data,
    /// Nothing could be tested: the log does not move enough.
    #[default]
    CannotTell,
    /// What is missing, or a part of it that matters, is in no effect of the library.
    Outside,
    /// Several explanations fit equally.
    Tie,
    /// The names remove a part of the gap on every record, and less than half of it on some.
    Likely,
    /// The names remove most of the gap on every record; what is left is described.
    NamedAndSomethingIsLeft,
    /// The names explain the gap to the noise.
    Named,
    /// Simulation and data agree to the noise.
    NothingMissing,
}

impl Grade {
    /// The grade of a verdict. `left`: something is left beside the names. `most`: they remove most of the gap everywhere.
    pub fn of(verdict: Verdict, left: bool, most: bool) -> Self {
        match (verdict, left, most) {
            (Verdict::Data, ..) => Self::Data,
            (Verdict::InsufficientExcitation, ..) => Self::CannotTell,
            (Verdict::Unexplained, ..) => Self::Outside,
            (Verdict::Tie, ..) => Self::Tie,
            (Verdict::Named, true, false) => Self::Likely,
            (Verdict::Named, true, true) => Self::NamedAndSomethingIsLeft,
            (Verdict::Named, false, _) => Self::Named,
            (Verdict::NothingMissing, ..) => Self::NothingMissing,
        }
    }

    /// The rate of false discoveries: of how many names that were given with this grade how many were wrong, in drawn cases that nobody had
    /// looked at (docs/results/README.md). Outsiders are among them.
    pub fn false_names(self) -> Option<[u32; 2]> {
        match self {
            Self::Named => Some([13, 1804]),
            Self::Tie => Some([12, 113]),
            _ => None,
        }
    }
}
