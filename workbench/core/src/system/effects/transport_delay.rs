//! Pure delay between command and terminal voltage.

use super::*;

/// The effect.
pub static TRANSPORT_DELAY: Effect = Effect {
    name: "transport_delay",
    summary: "the command acts later",
    equation: "v(t) = u(t − T)",
    source: "Ljung: System Identification, 2nd ed., 1999",
    signature: "residual follows the acceleration; no missing torque in steady motion",
    confusable_with: &[&ACTUATOR_LAG, &SENSOR_LAG, &INERTIA],
    separated_by: "square reversals; chirp up to a few over the delay",
    parameters: &[Parameter::new("seconds", "s", Scale::Time, 0.0, 2.0)],
    starts: Starts::Grid(&[&[0.01], &[0.04], &[0.1], &[0.25], &[0.6]]),
    apply: |p, plant| plant.delay_s += p[0],
    on_chip: OnChip::Known,
    ..Effect::USUAL
};
