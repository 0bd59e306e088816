//! First-order lag of the reading.

use super::*;

/// The effect.
pub static SENSOR_LAG: Effect = Effect {
    name: "sensor_lag",
    summary: "the sensor lags",
    equation: "T dy/dt = ω − y",
    source: "Doebelin: Measurement Systems, 5th ed., 2003",
    signature: "residual follows the acceleration; none in steady motion",
    confusable_with: &[&TRANSPORT_DELAY, &ACTUATOR_LAG, &INERTIA],
    separated_by: "log the current; a threshold effect in the same run (a limit, a dead zone) is delayed by the drive's lag but not by the sensor's",
    parameters: &[Parameter::new("time_constant_s", "s", Scale::Time, 0.0, 2.0)],
    starts: Starts::Grid(&[&[0.01], &[0.04], &[0.1], &[0.25], &[0.6]]),
    apply: |p, plant| plant.sensor_lag_s += p[0],
    ..Effect::USUAL
};
