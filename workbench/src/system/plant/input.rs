//! Input chain behind delay and lag: gain → offset → dead zone → limit. Memoryless.

use super::physics::Physics;

impl Physics {
    /// What the winding gets from a (delayed, lagged) command, V.
    #[inline]
    pub fn applied(&self, command: f64) -> f64 {
        self.limited(self.behind_dead_zone(self.drive_gain * command + self.drive_offset))
    }

    #[inline]
    fn behind_dead_zone(&self, u: f64) -> f64 {
        if self.dead_softness > 0.0 {
            return rounded(u - self.dead_pos, self.dead_softness)
                - rounded(-u - self.dead_neg, self.dead_softness);
        }
        (u - self.dead_pos).max(0.0) - (-u - self.dead_neg).max(0.0)
    }

    #[inline]
    fn limited(&self, u: f64) -> f64 {
        let limit = if u < 0.0 { self.limit * self.limit_skew } else { self.limit };
        if self.limit_softness > 1e-3 && limit.is_finite() {
            let x = (u / limit).abs();
            return u / (1.0 + x.powf(1.0 / self.limit_softness)).powf(self.limit_softness);
        }
        u.min(limit).max(-limit)
    }
}

/// max(x, 0) with its corner rounded over ±`softness`: softness·ln(1 + exp(x/softness)).
fn rounded(x: f64, softness: f64) -> f64 {
    let z = x / softness;
    if z > 30.0 { x } else { softness * z.exp().ln_1p() }
}
