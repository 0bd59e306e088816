//! Is a held-out record of the same motor?

use super::motion::{Base, Motion};
use crate::outcome::DataFault;
use crate::system::log::{Dynamic, Log};
use crate::system::model::Model;

/// A record that its own fit explains so well can be compared: at 0.91 a motor under a position loop was another one, at 0.975 one that
/// stood for most of the record.
const OWN: f64 = super::ENOUGH;
/// Rows that such a record has at least: a fit of seven forces explains any short record. Chosen by judgement, tried
/// with the others of `examine`.
const ROWS: usize = 300;
/// The fit of the log leaves so many times as much of the record as the record's own fit. Chosen by judgement, tried
/// with the others of `examine`.
const WORSE: f64 = 6.0;
/// And at least this share of it. Chosen by judgement, tried with the others of `examine`.
const MISSED: f64 = 0.25;
/// Where the log does not move as its model says, one motor for both leaves at least this share of one of them.
/// Origin: an effect outside the library that changes one record's response leaves a tenth; motors of half the gain
/// leave 0.18 and more.
const MISSED_BY_BOTH: f64 = 0.15;
/// A log agrees with its model where gain and time constant lie within this factor. Chosen by judgement, tried with
/// the others of `examine`.
const AGREES: f64 = 1.5;
/// The gain differs by this factor: one motor warms up, its grease thickens, its battery sags. Chosen by judgement,
/// tried with the others of `examine`.
const GAIN_DIFFERS: f64 = 1.8;
/// Beyond this factor a fit has left gain and time constant open: dry friction alone explains a record of two levels.
/// Chosen by judgement, tried with the others of `examine`.
const OPEN: f64 = 50.0;

/// A held-out record that moves like another motor.
pub fn fault(model: &Model, log: &Dynamic, other: &Log) -> Option<DataFault> {
    let Log::Dynamic(other) = other else { return None };
    if other.input != log.input || other.linear != log.linear {
        return None;
    }
    let base = Base::of(&model.kind, log.input).filter(|base| base.rate > 0.0)?;
    let (mine, theirs) = (Motion::of(log)?, Motion::of(other)?);
    let (fit, own) = (mine.free(&base)?, theirs.free(&base)?);
    if fit.explained < OWN || own.explained < OWN || mine.rows().min(theirs.rows()) < ROWS {
        return None;
    }
    // Records of one level or one direction leave gain, friction and load open: what explains both is no other motor.
    let both = mine.joined(&theirs).free(&base)?;
    let by_both = theirs.explained_by(&both).min(mine.explained_by(&both));
    let by_log = theirs.explained_by(&fit);
    let gains = (own.slope / own.rate) / (fit.slope / fit.rate);
    let rates = own.rate / fit.rate;
    let known = |factor: f64| factor.abs().ln().abs() < OPEN.ln();
    let apart = known(gains) && known(rates) && (gains <= 0.0 || gains.ln().abs() > GAIN_DIFFERS.ln());
    let misses = |explained: f64| 1.0 - explained > WORSE * (1.0 - own.explained);
    // A log that moves as its model says leaves no doubt which record is the stranger.
    let near = |factor: f64| factor > 0.0 && factor.ln().abs() < AGREES.ln();
    let agrees = near((fit.slope / fit.rate) / (base.slope / base.rate)) && near(fit.rate / base.rate);
    let neither = if agrees { misses(by_both) } else { 1.0 - by_both > MISSED_BY_BOTH };
    let missed = misses(by_log) && 1.0 - by_log > MISSED && neither;
    let what = format!(
        "{} is of another motor than {}: it takes {gains:.2} times the gain and {:.2} times the time constant to explain it",
        other.source,
        log.source,
        1.0 / rates
    );
    let remedy = "give a record of the same motor to --holdout";
    (missed && apart).then(|| super::fault(&other.source, what, remedy, [by_log, own.explained]))
}
