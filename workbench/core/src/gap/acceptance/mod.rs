//! The one place in which names are accepted.
//!
//! A set of names earns its place beside a smaller one if it explains more than its further names cost, if that is large
//! enough to be a physical effect, and if it is confirmed where it was not fitted. What explaining means depends on the
//! data: over a record it is measured by the [noise], for a model that is itself a fit to the log by [shares](residual_share) of the
//! residual, and over a table of settled speeds by the [table](crate::gap::tables)'s own scatter.

pub mod noise;
pub mod prediction;
pub mod residual_share;

use crate::gap::fit::hypothesis::Data;
use crate::gap::fit::scored::Scored;
use crate::gap::order::by_least;

/// Gain that a name must bring, in twice the logarithm of the likelihood: χ² over a record, n·ln(mean square) over a
/// table, whose noise is unknown. Origin: the evidence of 2 in the log-likelihood that Kass and Raftery (J. Am. Stat.
/// Assoc. 90, 1995) call very strong is 10; with a dozen candidates the chance of one false name stays below 1 %.
pub const NAME: f64 = 12.0;
/// Sets within this of the best explain the data as well, in the same unit. Chosen by judgement, below [`NAME`]; not
/// studied.
const TIED: f64 = 10.0;

/// The gain that a name must bring. `dispersion`: what the residuals are more than independent noise, by their size and by
/// the correlation of neighbours.
pub fn price(dispersion: f64) -> f64 {
    NAME * dispersion
}

/// The difference below which two sets are a tie where the residuals are so far from independent noise.
pub fn tied(dispersion: f64) -> f64 {
    TIED * dispersion
}

/// What a larger set has before a smaller one.
pub struct Weighed {
    /// How much more it explains.
    pub gain: f64,
    /// What its further names cost, in the same unit.
    pub cost: f64,
    /// True if the gain is large enough to be a physical effect.
    pub material: bool,
}

/// What counts as explaining on one kind of data.
pub trait Evidence<'a> {
    /// What the sets are fitted to.
    type Data: Data;

    /// Weighs a larger set against a smaller one.
    fn weighed(&self, smaller: &Scored<'a, Self::Data>, larger: &Scored<'a, Self::Data>) -> Weighed;

    /// True if the gain is told from nothing by data to which the larger set was not fitted. It is asked last, because it
    /// may take fits of its own.
    fn confirmed(&self, _: &Scored<'a, Self::Data>, _: &Scored<'a, Self::Data>, _gain: f64) -> bool {
        true
    }
}

/// What the other sets are beside the standing one.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Others {
    /// They have something more, and are tried in the order in which they stand.
    Larger,
    /// They lack something, and are tried in the order of what they explain less.
    Smaller,
}

/// The first of some other sets that takes the place of the standing one, and by how much the larger of the two explains
/// more. A larger set must earn its place; a smaller one takes the place of a set that does not earn its own.
pub fn decided<'a, E: Evidence<'a>>(
    evidence: &E,
    standing: &Scored<'a, E::Data>,
    which: Others,
    others: impl IntoIterator<Item = Scored<'a, E::Data>>,
) -> Option<(Scored<'a, E::Data>, f64)> {
    let earns = |smaller: &Scored<'a, E::Data>, larger: &Scored<'a, E::Data>, weighed: &Weighed| {
        weighed.gain >= weighed.cost && weighed.material && evidence.confirmed(smaller, larger, weighed.gain)
    };
    if which == Others::Larger {
        return others.into_iter().find_map(|larger| {
            let weighed = evidence.weighed(standing, &larger);
            earns(standing, &larger, &weighed).then_some((larger, weighed.gain))
        });
    }
    let weigh = |smaller| (evidence.weighed(&smaller, standing), smaller);
    let mut weighed: Vec<(Weighed, Scored<'a, E::Data>)> = others.into_iter().map(weigh).collect();
    by_least(&mut weighed, |it| it.0.gain);
    let missed = weighed.into_iter().find(|(weighed, smaller)| !earns(smaller, standing, weighed));
    missed.map(|(weighed, smaller)| (smaller, weighed.gain))
}
