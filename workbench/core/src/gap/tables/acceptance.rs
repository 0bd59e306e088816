//! Names over a table of settled speeds, whose noise is unknown: a mean square must fall.

use crate::gap::acceptance::{Evidence, Weighed, price};
use crate::gap::fit::scored::Scored;
use crate::gap::tables::rows::Rows;

/// The mean square has to fall by this factor, or the effect is not worth a name. Chosen by judgement; not studied.
const FACTOR: f64 = 1.15;
/// The part of an effect in the residual has to be larger than this share of the largest reading: the error budget of
/// a map. Chosen by judgement, as that of a record (`VALUE` in `dataset/weigh.rs`); not studied.
const VISIBLE: f64 = 3e-4;

/// Sets that are fitted to rows.
pub struct OverTable<'a>(pub &'a Rows);

impl<'a> Evidence<'a> for OverTable<'a> {
    type Data = Rows;

    fn weighed(&self, smaller: &Scored<'a, Rows>, larger: &Scored<'a, Rows>) -> Weighed {
        let floor = self.0.resolution.powi(2);
        let (before, after) = (smaller.mean_square() + floor, larger.mean_square() + floor);
        Weighed {
            gain: smaller.score - larger.score,
            cost: price(larger.inflation()),
            material: before > FACTOR * after && (before - after).sqrt() > VISIBLE * self.0.largest_speed(),
        }
    }
}
