//! The winding heats up and its resistance grows.

use super::*;

/// The effect.
pub static THERMAL_RESISTANCE: Effect = Effect {
    name: "thermal_resistance",
    summary: "the resistance grows as the winding heats up",
    equation: "R = R0·(1 + rise·P), T dP/dt = i²R − P, rise·P(0) = start_rise",
    source: "Hughes, Drury: Electric Motors and Drives, 4th ed., 2013",
    signature: "missing torque follows the current, and grows with the heating history",
    confusable_with: &[&RESISTANCE, &SUPPLY_SAG],
    separated_by: "the same segment early and late in a run",
    parameters: &[
        Parameter::new("rise_per_w", "1/W", Scale::PerPower, 0.0, 30.0),
        Parameter::new("time_constant_s", "s", Scale::Time, 1.0, 1000.0),
        // Copper gains 39 % in 100 K.
        Parameter::new("start_rise", "1", Scale::One, 0.0, 1.0).optional(0.0).meaning(Meaning::AtStart),
    ],
    starts: Starts::Grid(&[
        &[0.3, 8.0, 0.0],
        &[0.3, 40.0, 0.0],
        &[0.5, 200.0, 0.0],
        &[1.5, 8.0, 0.0],
        &[1.5, 40.0, 0.0],
        &[2.5, 200.0, 0.0],
        &[6.0, 8.0, 0.0],
        &[6.0, 40.0, 0.0],
        &[10.0, 200.0, 0.0],
    ]),
    axis: Axis::BackEmf,
    form: Form::Absorbed,
    apply: |p, plant| {
        plant.heat_rise_per_w += p[0];
        plant.heat_time_s = p[1];
        plant.heat_start += p[2];
    },
    ..Effect::USUAL
};
