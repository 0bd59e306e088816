//! Output chain: true speed → scale → rectification → lag → clamp → offset. The position reading is its integral. The offset is
//! that of the reading: what converts it adds it, behind all that the sensor does.

use super::features::Features;
use super::physics::Physics;
use super::simd::Lanes;
use super::state::State;
use super::step::Before;

impl Physics {}

impl<F: Lanes> Physics<F> {
    /// Scale and rectification of a true speed.
    #[inline(always)]
    pub fn scaled(&self, omega: F) -> F {
        let scaled = self.sensor_scale * omega;
        if self.sensor_rectified { scaled.abs() } else { scaled }
    }

    /// Mean of the scaled speed over a step. A magnitude whose speed changes its sign on the way has a larger one than the
    /// mean speed: both triangles count.
    #[inline(always)]
    fn mean(&self, from: F, to: F, mean: F) -> F {
        if !self.sensor_rectified {
            return self.scaled(mean);
        }
        let triangles = (from * from + to * to) * 0.5 / (from - to).abs();
        let turns = (from * to).lt(from.like(0.0));
        self.scaled(F::select(turns, triangles, mean))
    }

    /// Clamp and offset behind the lag.
    #[inline(always)]
    pub fn reading_of(&self, lagged: F) -> F {
        lagged.within(self.sensor_limit) + self.sensor_offset
    }

    /// Advances the reading over one step. `decay`: rest of the sensor's lag after it.
    #[inline(always)]
    pub(super) fn sense(
        &self,
        features: &Features,
        state: &mut State<F>,
        before: &Before<F>,
        h: f64,
        decay: F,
    ) {
        let at_load = features.at_load;
        let (theta, omega) =
            if at_load { (state.theta_load, state.omega_load) } else { (state.theta, state.omega) };
        let (was, omega_before) =
            if at_load { (before.theta_load, before.omega_load) } else { (before.theta, before.omega) };
        if !(features.sensor_lag || features.sensor_limit || features.rectified) {
            // Scale and offset alone: the integral of the reading is exact.
            state.reading = self.sensor_scale * omega + self.sensor_offset;
            state.lagged = state.reading;
            let way = self.sensor_scale * (theta - was) + self.sensor_offset * h;
            state.reading_integral = state.reading_integral + way;
            return;
        }
        let mean = self.mean(omega_before, omega, (theta - was) * (1.0 / h));
        if !features.sensor_lag {
            state.lagged = self.scaled(omega);
            state.reading = self.reading_of(state.lagged);
            state.reading_integral = state.reading_integral + self.reading_of(mean) * h;
            return;
        }
        let rest = before.lagged - mean;
        let lagged_mean = mean + rest * (-decay + 1.0) * self.sensor_lag_s * (1.0 / h);
        state.lagged = mean + rest * decay;
        state.reading = self.reading_of(state.lagged);
        state.reading_integral = state.reading_integral + self.reading_of(lagged_mean) * h;
    }
}
