//! Output chain: true speed → scale and offset → rectification → lag → clamp. The position reading is its integral.

use super::physics::Physics;
use super::state::State;
use super::step::Before;

impl Physics {
    /// Scale, offset and rectification of a true speed.
    #[inline]
    pub fn scaled(&self, omega: f64) -> f64 {
        let scaled = self.sensor_scale * omega + self.sensor_offset;
        if self.sensor_rectified {
            scaled.abs()
        } else {
            scaled
        }
    }

    /// The clamp behind the lag.
    #[inline]
    pub fn reading_of(&self, lagged: f64) -> f64 {
        lagged.clamp(-self.sensor_limit, self.sensor_limit)
    }

    /// Scale and offset alone: the integral of the reading is exact.
    #[inline]
    fn plain_sensor(&self) -> bool {
        self.sensor_lag_s <= 0.0 && self.sensor_limit == f64::INFINITY && !self.sensor_rectified
    }

    /// Advances the reading over one step.
    #[inline]
    pub(super) fn sense(&self, state: &mut State, before: &Before, h: f64) {
        let at_load = self.encoder_at_load;
        let (theta, omega) = if at_load {
            (state.theta_load, state.omega_load)
        } else {
            (state.theta, state.omega)
        };
        let was = if at_load { before.theta_load } else { before.theta };
        if self.plain_sensor() {
            state.reading = self.sensor_scale * omega + self.sensor_offset;
            state.lagged = state.reading;
            state.reading_integral += self.sensor_scale * (theta - was) + self.sensor_offset * h;
            return;
        }
        if self.sensor_lag_s <= 0.0 {
            state.lagged = self.scaled(omega);
            state.reading = self.reading_of(state.lagged);
            state.reading_integral += h * self.reading_of(self.scaled((theta - was) / h));
            return;
        }
        let mean = self.scaled((theta - was) / h);
        let decay = (-h / self.sensor_lag_s).exp();
        let lagged_mean = mean + (before.lagged - mean) * (1.0 - decay) * self.sensor_lag_s / h;
        state.lagged = mean + (before.lagged - mean) * decay;
        state.reading = self.reading_of(state.lagged);
        state.reading_integral += h * self.reading_of(lagged_mean);
    }
}
