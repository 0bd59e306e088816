//! What the remainder of a fit looks like. Verdicts ask the kind, reports take the words.

use super::words::name;
use crate::system::plant::unnamed::Variable;
use std::fmt;

/// What is left of a fit. `share`: what it explains of the residual's square, 0 … 1.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs)] // The variants say what their fields are.
pub enum Structure {
    /// Nothing to be seen.
    #[default]
    None,
    /// Neighbours in time are alike, and nothing else.
    Correlated,
    /// Nothing in the motion predicts it on held-out data.
    Unpredicted,
    /// A line in time, with its frequency in Hz.
    PeriodicInTime { hertz: f64, share: f64 },
    /// A line over the position: radians per turn of the sine and radian of the shaft, or 1/m on a linear axis.
    PeriodicInPosition { number: f64, linear: bool, share: f64 },
    /// A torque or a reading that changes over the turn of a shaft.
    Turn { share: f64 },
    /// A friction that changes over the turn of a shaft.
    FrictionOfTurn { share: f64 },
    /// A quantity of the motion, as a reader knows it, explains a part of it.
    FunctionOf { quantity: Variable, share: f64 },
    /// Two runs with the same input differ by so many times the noise, and slowly.
    Unrepeatable { times: f64 },
    /// The log is too short to say.
    TooFew,
    /// What fits the log does not predict the hold-out.
    OfEveryRecord,
    /// The model fits the log and misses a held-out record.
    AnotherMotor,
    /// A table over some variables predicts a part of it on held-out data: a sentence without its end, and what stays true
    /// beside it.
    Predicted { by: String, beside: Option<Box<Structure>> },
}

impl Structure {
    /// True if it goes with the turn of a shaft.
    pub fn turns(&self) -> bool {
        matches!(self, Self::Turn { .. } | Self::FrictionOfTurn { .. })
    }

    /// True if it stays true beside a dependence that is found later: a line, a place, runs that differ.
    pub fn stays(&self) -> bool {
        let periodic = matches!(self, Self::PeriodicInTime { .. } | Self::PeriodicInPosition { .. });
        periodic || self.turns() || matches!(self, Self::Unrepeatable { .. })
    }

    /// True if a quantity, a period, a place or a run explains a part of it.
    pub fn explains(&self) -> bool {
        self.stays() || matches!(self, Self::FunctionOf { .. })
    }
}

impl fmt::Display for Structure {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        let of = |share: &f64| format!("({:.0} % of what is left)", 100.0 * share);
        match self {
            Self::None => text.write_str("none"),
            Self::Correlated => text.write_str("noise-like, correlated in time"),
            Self::Unpredicted => {
                text.write_str("noise-like: nothing in the motion predicts it on held-out data")
            }
            Self::PeriodicInTime { hertz, share } => {
                write!(text, "periodic in time at {hertz:.3} Hz {}", of(share))
            }
            Self::PeriodicInPosition { number, linear: true, share } => {
                let metres = std::f64::consts::TAU / number;
                write!(text, "periodic in position, every {metres:.4} m {}", of(share))
            }
            Self::PeriodicInPosition { number, linear: false, share } => {
                write!(text, "periodic in position, with {number:.2} periods per turn {}", of(share))
            }
            Self::Turn { share } => write!(text, "goes with the turn {}", of(share)),
            Self::FrictionOfTurn { share } => {
                write!(text, "a friction that goes with the turn {}", of(share))
            }
            Self::FunctionOf { quantity, share } => {
                write!(text, "a function of {} {}", name(*quantity), of(share))
            },
            Self::Unrepeatable { times } => write!(
                text,
                "not repeatable: two runs with the same input differ by {times:.1} times the noise, and slowly"
            ),
            Self::TooFew => text.write_str(
                "the log has too few samples to say what it looks like; log more runs, in both directions",
            ),
            Self::OfEveryRecord => text.write_str(
                "different in every record: what fits the log does not predict the hold-out",
            ),
            Self::AnotherMotor => text.write_str(
                "the model fits the log and misses a held-out record: check that it is of the same motor, with the same load, in the same units, and not beyond what the log shows",
            ),
            Self::Predicted { by, beside: None } => text.write_str(by),
            Self::Predicted { by, beside: Some(also) } => write!(text, "{by}; {also}"),
        }
    }
}
