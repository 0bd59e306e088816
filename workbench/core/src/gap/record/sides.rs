//! What it costs to give one number to two sides.

use crate::gap::fit::FINAL;
use crate::gap::fit::hypothesis::{Item, Slot};
use crate::gap::fit::scored::{Scored, dispersion};
use crate::gap::plots::curve::torque_unit;
use crate::outcome::DEVIATIONS;
use crate::system::effects::{Effect, LIBRARY};
use crate::text::figures::percent;
use crate::text::figures::{figure, gap};

/// The two sides of an even effect of a set, fitted apart, and what the held-out gap would be with them, in a sentence.
pub fn told(kept: &Scored, index: usize, gap_of: impl Fn(&Scored) -> f64) -> Option<String> {
    let even = kept.hypothesis.items[index];
    let of = |uneven: &&Effect| uneven.relations.uneven_of.is_some_and(|of| of.even == even.effect);
    let uneven = LIBRARY.iter().copied().find(of).filter(|uneven| uneven.on_records())?;
    let apart = if even.is_full() { Item::full(uneven) } else { Item::plain(uneven) };
    let hypothesis = kept.hypothesis.with_item(index, apart);
    let both = |parameter: usize| kept.hypothesis.slot(index, parameter).map_or(0.0, |slot| kept.fit.x[slot]);
    let from = |slot: &Slot| match slot {
        Slot::Effect { parameter, .. } => both(parameter.saturating_sub(1)),
        _ => 0.0,
    };
    let x = hypothesis.carried(&kept.hypothesis, &kept.fit.x, &from);
    let set = Scored::fitted(hypothesis, &x, &FINAL);
    let dataset = kept.hypothesis.dataset;
    let (unit, size) = match uneven.parameters[0].scale.is_torque() {
        true => torque_unit(kept),
        false => (dataset.input.unit(), 1.0),
    };
    let [one, other] = [0, 1].map(|side| set.hypothesis.value(index, side, &set.fit.x) / size);
    let differ = percent((one - other).abs() / (0.5 * (one + other)).max(f64::MIN_POSITIVE));
    let apart = ((kept.fit.cost - set.fit.cost).max(0.0) / dispersion(&set)).sqrt();
    let sides = format!("Fitted apart, its two sides are {} and {} {unit}", figure(one), figure(other));
    let gaps = [&set, kept].map(|set| gap(gap_of(set)));
    (apart < DEVIATIONS || gaps[0] != gaps[1]).then(|| match apart < DEVIATIONS {
        true => format!("{sides}: these data do not tell them apart ({apart:.1} standard deviations)."),
        false => format!(
            "{sides}: {differ} are too little for a name of their own, but these data tell them apart ({apart:.0} standard deviations). With two sides the held-out gap would be {} {}, not {}.",
            gaps[0], dataset.unit(), gaps[1]
        ),
    })
}
