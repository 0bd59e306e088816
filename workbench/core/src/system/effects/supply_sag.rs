//! The supply falls with the current that is drawn; with a bus capacity it follows with a lag.

use super::*;

/// The effect.
pub static SUPPLY_SAG: Effect = Effect {
    name: "supply_sag",
    summary: "the supply voltage falls with the current drawn",
    equation: "Vbus = V0 − source·(u/V0)·i; C dVbus/dt = (V0 − Vbus)/source − (u/V0)·i",
    source: "Krishnan: Electric Motor Drives, 2001",
    signature: "missing torque grows as u²·i",
    confusable_with: &[&RESISTANCE, &DRIVE_GAIN, &VOLTAGE_SATURATION],
    separated_by: "steps at small and at full voltage; log vbus_v, which shows it directly",
    parameters: &[
        Parameter::new("source_ohm", "Ω", Scale::Resistance, 0.0, 4.0),
        Parameter::new("bus_farad", "F", Scale::Capacity, 0.0, 20.0).optional(0.0),
    ],
    starts: Starts::Grid(&[&[0.02, 0.0], &[0.1, 0.0], &[0.3, 0.0], &[0.8, 0.0]]),
    axis: Axis::Winding,
    offered: Offered::Both(Steady::new(Role::Representative, Shape::Bend).forms(Forms::Plain)),
    // The duty is the voltage over the supply that the chip measures.
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.source_ohm += p[0];
        plant.bus_farad = plant.bus_farad.max(p[1]);
    },
    ..Effect::USUAL
};
