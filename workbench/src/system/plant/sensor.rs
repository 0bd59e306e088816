//! Output chain: true speed → scale → rectification → lag → clamp → offset. The position reading is its integral. The offset is
//! that of the reading: what converts it adds it, behind all that the sensor does.

use super::physics::Physics;
use super::state::State;
use super::step::Before;

impl Physics {
    /// Scale and rectification of a true speed.
    #[inline]
    pub fn scaled(&self, omega: f64) -> f64 {
        let scaled = self.sensor_scale * omega;
        if self.sensor_rectified { scaled.abs() } else { scaled }
    }

    /// Mean of the scaled speed over a step. A magnitude whose speed changes its sign on the way has a larger one than the
    /// mean speed: both triangles count.
    #[inline]
    fn mean(&self, from: f64, to: f64, mean: f64) -> f64 {
        if self.sensor_rectified && from * to < 0.0 {
            let triangles = 0.5 * (from * from + to * to) / (from - to).abs();
            return self.scaled(triangles);
        }
        self.scaled(mean)
    }

    /// The speed behind a reading of a motion that just goes on; of a magnitude, the positive one.
    pub fn speed_behind(&self, reading: f64) -> f64 {
        (reading - self.sensor_offset) / self.sensor_scale
    }

    /// Clamp and offset behind the lag.
    #[inline]
    pub fn reading_of(&self, lagged: f64) -> f64 {
        lagged.clamp(-self.sensor_limit, self.sensor_limit) + self.sensor_offset
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
        let (theta, omega) =
            if at_load { (state.theta_load, state.omega_load) } else { (state.theta, state.omega) };
        let (was, omega_before) =
            if at_load { (before.theta_load, before.omega_load) } else { (before.theta, before.omega) };
        if self.plain_sensor() {
            state.reading = self.sensor_scale * omega + self.sensor_offset;
            state.lagged = state.reading;
            state.reading_integral += self.sensor_scale * (theta - was) + self.sensor_offset * h;
            return;
        }
        if self.sensor_lag_s <= 0.0 {
            state.lagged = self.scaled(omega);
            state.reading = self.reading_of(state.lagged);
            let mean = self.mean(omega_before, omega, (theta - was) / h);
            state.reading_integral += h * self.reading_of(mean);
            return;
        }
        let mean = self.mean(omega_before, omega, (theta - was) / h);
        let decay = (-h / self.sensor_lag_s).exp();
        let lagged_mean = mean + (before.lagged - mean) * (1.0 - decay) * self.sensor_lag_s / h;
        state.lagged = mean + (before.lagged - mean) * decay;
        state.reading = self.reading_of(state.lagged);
        state.reading_integral += h * self.reading_of(lagged_mean);
    }
}
