//! Is a held-out record of the same motor?

use super::motion::{Base, Motion};
use crate::outcome::DataFault;
use crate::system::log::{Dynamic, Log};
use crate::system::model::Model;

/// A record that its own fit explains so well can be compared.
const OWN: f64 = 0.9;
/// What the fit of the log leaves of it is so many times what its own fit leaves.
const WORSE: f64 = 6.0;
/// And at least this share.
const MISSED: f64 = 0.25;
/// The gain differs by this factor, or the time constant by the other: one motor warms up, its grease thickens, its battery sags.
const GAIN_DIFFERS: f64 = 1.8;
const TIME_DIFFERS: f64 = 2.5;

/// A held-out record that moves like another motor.
pub fn fault(model: &Model, log: &Dynamic, other: &Log) -> Option<DataFault> {
    let Log::Dynamic(other) = other else { return None };
    if other.input != log.input || other.linear != log.linear {
        return None;
    }
    let base = Base::of(model, log.input).filter(|base| base.rate > 0.0)?;
    let (mine, theirs) = (Motion::of(log)?, Motion::of(other)?);
    let (fit, own) = (mine.free(&base)?, theirs.free(&base)?);
    if fit.explained < OWN || own.explained < OWN {
        return None;
    }
    // Records of one level or one direction leave gain, friction and load open: what explains both is no other motor.
    let both = mine.joined(&theirs).free(&base)?;
    let by_both = theirs.explained_by(&both).min(mine.explained_by(&both));
    let by_log = theirs.explained_by(&fit);
    let gains = (own.slope / own.rate) / (fit.slope / fit.rate);
    let rates = own.rate / fit.rate;
    let apart = |ratio: f64, factor: f64| ratio <= 0.0 || ratio.ln().abs() > factor.ln();
    let misses = |explained: f64| 1.0 - explained > WORSE * (1.0 - own.explained);
    let missed = misses(by_log) && misses(by_both) && 1.0 - by_log > MISSED;
    (missed && (apart(gains, GAIN_DIFFERS) || apart(rates, TIME_DIFFERS))).then(|| DataFault {
        place: other.source.clone(),
        what: format!(
            "{} is of another motor than {}: it takes {:.2} times the gain and {:.2} times the time constant to explain it",
            other.source,
            log.source,
            gains,
            1.0 / rates
        ),
        explained_as_it_stands: by_log.max(0.0),
        explained_with_it: own.explained,
        remedy: "give a record of the same motor to --holdout".into(),
    })
}
