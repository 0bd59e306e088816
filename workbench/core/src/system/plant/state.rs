//! What the plant remembers.

use super::physics::Physics;
use super::simd::Lanes;
use super::unnamed::Reversal;

/// The plant's state, or the states of several in lock-step. SI units; on a linear axis read m for rad.
#[derive(Clone, Copy, Debug, Default)]
pub struct State<F = f64> {
    /// Time since the start, s.
    pub time_s: f64,
    /// Position of the motor, rad.
    pub theta: F,
    /// Speed of the motor, rad/s.
    pub omega: F,
    /// Winding current, A.
    pub current: F,
    /// Mean winding current over the last step, A.
    pub mean_current: F,
    /// Heat in the winding as the power that would hold it, W.
    pub heat_w: F,
    /// Supply voltage, V.
    pub supply_v: F,
    /// Position of the load, rad, when it may differ from the motor's.
    pub theta_load: F,
    /// Speed of the load, rad/s.
    pub omega_load: F,
    /// Lagged reading of the speed, rad/s.
    pub lagged: F,
    /// Reading of the speed, rad/s.
    pub reading: F,
    /// Integral of the reading: the position as the sensor sees it, rad.
    pub reading_integral: F,
    /// The last change of direction; followed only where a term without a name asks for it.
    pub reversal: Reversal,
}

impl<F: Lanes> State<F> {
    /// At `theta`, moving with `omega`, everything else settled at that speed without current.
    #[inline(always)]
    pub fn moving(plant: &Physics<F>, theta: F, omega: F) -> Self {
        let (none, tiny) = (theta.like(0.0), theta.like(f64::MIN_POSITIVE));
        let lagged = plant.scaled(omega);
        Self {
            time_s: 0.0,
            theta,
            omega,
            current: none,
            mean_current: none,
            heat_w: plant.heat_start / plant.heat_rise_per_w.max(tiny),
            supply_v: plant.supply_v,
            theta_load: theta,
            omega_load: omega,
            lagged,
            reading: plant.reading_of(lagged),
            reading_integral: plant.sensor_scale * theta,
            reversal: Reversal::default(),
        }
    }

    /// States of plants in lock-step at the same time; the last one fills what is left. `like`: any number, for its width.
    pub fn side_by_side(states: &[State], like: F) -> Self {
        let of = |number: fn(&State) -> f64| like.of(|set| number(&states[set.min(states.len() - 1)]));
        Self {
            time_s: states[0].time_s,
            theta: of(|it| it.theta),
            omega: of(|it| it.omega),
            current: of(|it| it.current),
            mean_current: of(|it| it.mean_current),
            heat_w: of(|it| it.heat_w),
            supply_v: of(|it| it.supply_v),
            theta_load: of(|it| it.theta_load),
            omega_load: of(|it| it.omega_load),
            lagged: of(|it| it.lagged),
            reading: of(|it| it.reading),
            reading_integral: of(|it| it.reading_integral),
            reversal: states[0].reversal,
        }
    }
}
