//! What a user may choose of a search, and the shares of the squared error by which names are judged where a model is itself a fit to
//! the log.

use crate::system::log::Dynamic;

/// What the user may choose.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Effects that are not offered to a record.
    pub without: Vec<String>,
    /// Records that are only predicted, at the very end: the held-out records may refuse names, these choose nothing.
    pub finals: Vec<Dynamic>,
    /// Limits of the search for a model that is a fit to the log.
    pub limits: ShareLimits,
    /// Go on although the files look wrong; what was found is told as a note.
    pub accept_data: bool,
}

/// Limits of the search by shares. Origin: set on the rigs of `data/rigs/`, and moved in the leave-one-rig-out study (`cargo run -p
/// evaluation -- leave-one-rig-out`): of 40 rigs 38 were answered as expected, and with one limit lower / higher 38 / 38 (`joins`
/// 0.08 / 0.25), 36 / 36 (`stays` 0.12 / 0.4), 38 / 37 (`points` 0.25 / 1), 37 / 39 (`richer` 0.7 / 0.9), 36 / 38 (`against_given`
/// 0.5 / 0.8).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShareLimits {
    /// A name joins if it removes this share of the log's squared error. A little less than what it needs to stay, because a further
    /// name may sharpen it.
    pub joins: f64,
    /// A name stays if, with everything fitted anew without it, the squared error grows by this share, on the log and on the held-out
    /// records together, and on every one of them by a twentieth. On measured rigs right first names remove 0.29 to 0.998 of it and mimics in third place 0.02 to 0.21.
    pub stays: f64,
    /// A name stays if the held-out fit falls by so many points without it. Below that it is told as small: nobody would miss it in a
    /// simulation.
    pub points: f64,
    /// What a richer form must leave of the squared error that the plain set leaves, on the folds and on every held-out record.
    pub richer: f64,
    /// What a set must leave of the squared error of the model as given, on the held-out records together; on none may it leave more.
    pub against_given: f64,
    /// A set that leaves more than this of the squared error of the model as given, on the log or on a held-out record, is likely and no
    /// more. The three mimics that removed more than half in a study of twenty were lags of the sensor, which are not named on less.
    pub likely: f64,
}

impl Default for ShareLimits {
    fn default() -> Self {
        Self { joins: 0.15, stays: 0.25, points: 0.5, richer: 0.8, against_given: 0.65, likely: 0.5 }
    }
}
