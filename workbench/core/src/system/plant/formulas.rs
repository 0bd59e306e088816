//! Small formulas of a step.

use super::simd::Lanes;
use std::f64::consts::PI;

/// A contact that is over within such a part of a step is inelastic for every log. Origin: four pieces kept all names
/// of 22 rigs and saved no work.
const MOST_CONTACT_PIECES: f64 = 12.0;

/// Speeds of motor and load at the end of a step, and the weight of the motor's speed there in its mean.
pub(super) type Moved<F> = (F, F, F);

/// Speeds of one kind or the other, set by set.
#[inline(always)]
pub(super) fn select<F: Lanes>(mask: F::Mask, yes: Moved<F>, no: Moved<F>) -> Moved<F> {
    (F::select(mask, yes.0, no.0), F::select(mask, yes.1, no.1), F::select(mask, yes.2, no.2))
}

/// A value on its way to where it settles, in the middle of the step.
#[inline(always)]
pub(super) fn halfway<F: Lanes>(value: F, settled: F, h: f64, time_constant: F) -> F {
    let share = value.like(0.5 * h) / time_constant.max(value.like(1e-12));
    value + (settled - value) * share.min(value.like(1.0))
}

/// Pieces of a step that turns a resonance by so many radians. One beyond half a turn is faster than any log could
/// show; the trapezoid leaves it rigid.
pub(super) fn resonance_pieces(turned: f64) -> f64 {
    if turned > PI { 2.0 } else { (turned / 0.35).ceil().max(1.0) }
}

/// Pieces of a step in which teeth may touch and part.
pub(super) fn contact_pieces(turned: f64) -> f64 {
    (turned / 0.35).ceil().clamp(1.0, MOST_CONTACT_PIECES)
}

/// 1/(1 + (current/knee)²).
#[inline(always)]
pub(super) fn softened<F: Lanes>(current: F, knee: F) -> F {
    let ratio = current / knee;
    current.like(1.0) / (ratio * ratio + 1.0)
}
