//! Input chain behind delay and lag: gain → offset → dead zone → limit. Memoryless.

use super::physics::Physics;
use super::simd::Lanes;

/// Which of its parts the chain has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chain {
    delay: bool,
    lag: bool,
    soft_dead_zone: bool,
    limited: bool,
    soft_limit: bool,
}

impl Chain {
    /// Those of a plant.
    pub fn of(p: &Physics) -> Self {
        let limited = p.limit.is_finite();
        Self {
            delay: p.delay_s > 0.0,
            lag: p.lag_s > 0.0,
            soft_dead_zone: p.dead_softness > 0.0,
            limited,
            soft_limit: limited && p.limit_softness > 1e-3,
        }
    }
}

impl Physics {
    /// What the winding gets from a (delayed, lagged) command, V.
    #[inline]
    pub fn applied(&self, command: f64) -> f64 {
        self.applied_to(&Chain::of(self), command)
    }
}

impl<F: Lanes> Physics<F> {
    /// The same where the kinds are known.
    #[inline(always)]
    pub fn applied_to(&self, chain: &Chain, command: F) -> F {
        let u = self.behind_dead_zone(chain, self.drive_gain * command + self.drive_offset);
        if chain.limited { self.limited(chain, u) } else { u }
    }

    #[inline(always)]
    fn behind_dead_zone(&self, chain: &Chain, u: F) -> F {
        let (forward, backward) = (u - self.dead_pos, -u - self.dead_neg);
        if chain.soft_dead_zone {
            return rounded(forward, self.dead_softness) - rounded(backward, self.dead_softness);
        }
        forward.max(u.like(0.0)) - backward.max(u.like(0.0))
    }

    #[inline(always)]
    fn limited(&self, chain: &Chain, u: F) -> F {
        let limit = F::select(u.lt(u.like(0.0)), self.limit * self.limit_skew, self.limit);
        if !chain.soft_limit {
            return u.within(limit);
        }
        let (softness, x) = (self.limit_softness, (u / limit).abs());
        // Powers are taken set by set.
        u.of(|set| {
            let softness = softness.lane(set);
            u.lane(set) / (1.0 + x.lane(set).powf(1.0 / softness)).powf(softness)
        })
    }
}

/// max(x, 0) with its corner rounded over ±`softness`: softness·ln(1 + exp(x/softness)).
#[inline(always)]
fn rounded<F: Lanes>(x: F, softness: F) -> F {
    let z = x / softness;
    F::select(z.gt(z.like(30.0)), x, softness * z.map(|z| z.exp().ln_1p()))
}
