//! What the plant remembers.

use super::physics::Physics;
use super::unnamed::Reversal;

/// The plant's state. SI units; on a linear axis read m for rad.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    /// Time since the start, s.
    pub time_s: f64,
    /// Position of the motor, rad.
    pub theta: f64,
    /// Speed of the motor, rad/s.
    pub omega: f64,
    /// Winding current, A.
    pub current: f64,
    /// Mean winding current over the last step, A.
    pub mean_current: f64,
    /// Heat in the winding as the power that would hold it, W.
    pub heat_w: f64,
    /// Supply voltage, V.
    pub supply_v: f64,
    /// Position of the load, rad, when it may differ from the motor's.
    pub theta_load: f64,
    /// Speed of the load, rad/s.
    pub omega_load: f64,
    /// Lagged reading of the speed, rad/s.
    pub lagged: f64,
    /// Reading of the speed, rad/s.
    pub reading: f64,
    /// Integral of the reading: the position as the sensor sees it, rad.
    pub reading_integral: f64,
    /// The last change of direction; followed only where a term without a name asks for it.
    pub reversal: Reversal,
}

impl State {
    /// At `theta`, moving with `omega`, everything else settled at that speed without current.
    pub fn moving(plant: &Physics, theta: f64, omega: f64) -> Self {
        let mut state = Self {
            theta,
            omega,
            theta_load: theta,
            omega_load: omega,
            supply_v: plant.supply_v,
            ..Self::default()
        };
        state.lagged = plant.scaled(omega);
        state.reading = plant.reading_of(state.lagged);
        state.reading_integral = plant.sensor_scale * theta;
        state
    }
}
