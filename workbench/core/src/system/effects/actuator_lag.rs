//! First-order lag of the drive (filter, slow current loop).

use super::*;

/// The effect.
pub static ACTUATOR_LAG: Effect = Effect {
    name: "actuator_lag",
    summary: "the drive follows the command with a first-order lag",
    equation: "T dv/dt = u − v",
    source: "Ljung: System Identification, 2nd ed., 1999",
    signature: "residual follows the acceleration, most just after steps",
    confusable_with: &[&TRANSPORT_DELAY, &SENSOR_LAG, &INERTIA],
    separated_by: "square reversals sampled faster than the lag; chirp",
    parameters: &[Parameter::new("time_constant_s", "s", Scale::Time, 0.0, 2.0)],
    starts: Starts::Grid(&[&[0.01], &[0.04], &[0.1], &[0.25], &[0.6]]),
    apply: |p, plant| plant.lag_s += p[0],
    on_chip: OnChip::Known,
    ..Effect::USUAL
};
