//! The shares of the squared error by which names are judged where a model is itself a fit to the log.

/// Limits of the search by shares. The defaults were set on the rigs of `data/rigs/`; what each of them is worth on a rig that did
/// not take part is the leave-one-rig-out study (`cargo run -p evaluation --bin leave_one_rig_out`).
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
