//! Dead zone of the input: small commands move nothing. Its corners may be rounded (`softness_v`), as dither and
//! switching ripple do.

use super::*;

/// Equal on both sides.
pub static DEAD_ZONE: Effect = Effect {
    name: "dead_zone",
    summary: "small inputs have no effect, equally in both directions",
    equation: "v = u − w for u > w, u + w for u < −w, else 0",
    source: "Tao, Kokotović: Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996",
    signature: "missing torque −sign(u)·Kt·w/R outside the zone, Kt·u/R inside; nothing while the bridge is open",
    confusable_with: &[&COULOMB_FRICTION, &DRIVE_GAIN],
    separated_by: "square reversals: friction stays with the motion, the dead zone with the input; or a coast-down, which only friction brakes",
    parameters: &[
        Parameter::new("half_width_v", "V", Scale::Input, 0.0, 0.6),
        Parameter::new("softness_v", "V", Scale::Input, 0.0, 0.2).optional(0.0),
    ],
    starts: Starts::Grid(&[
        &[0.01, 0.0],
        &[0.03, 0.0],
        &[0.08, 0.0],
        &[0.15, 0.0],
        &[0.25, 0.0],
        &[0.4, 0.0],
    ]),
    family: Family::DeadZone,
    domain: Domain::SmallInputs,
    offered: Offered::Both(Steady::new(Role::Representative, Shape::Edges)),
    relations: Relations { inseparable_from: &[&VOLTAGE_OFFSET], ..Relations::NONE },
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.dead_pos += p[0];
        plant.dead_neg += p[0];
        plant.dead_softness = plant.dead_softness.max(p[1]);
    },
    ..Effect::USUAL
};

/// Different for the two directions.
pub static DEAD_ZONE_ASYMMETRIC: Effect = Effect {
    name: "dead_zone_asymmetric",
    summary: "small inputs have no effect, with different widths for the two directions",
    equation: "v = u − pos for u > pos, u + neg for u < −neg, else 0",
    source: "Tao, Kokotović: Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996",
    signature: "the trace of dead_zone, with different heights for the two signs of u",
    confusable_with: &[&DEAD_ZONE, &COULOMB_ASYMMETRIC, &VOLTAGE_OFFSET],
    separated_by: "slow triangle in both directions, then square reversals",
    parameters: &[
        Parameter::new("pos_v", "V", Scale::Input, 0.0, 0.6),
        Parameter::new("neg_v", "V", Scale::Input, 0.0, 0.6),
        Parameter::new("softness_v", "V", Scale::Input, 0.0, 0.2).optional(0.0),
    ],
    starts: Starts::Grid(&[
        &[0.01, 0.01, 0.0],
        &[0.03, 0.03, 0.0],
        &[0.08, 0.08, 0.0],
        &[0.15, 0.15, 0.0],
        &[0.25, 0.25, 0.0],
        &[0.4, 0.4, 0.0],
    ]),
    family: Family::DeadZone,
    domain: Domain::SmallInputs,
    form: Form::Rich,
    offered: Offered::Both(
        Steady::new(Role::Representative, Shape::Edges).needs(Needs::Reversal).never_beside(&SHIFTS),
    ),
    relations: Relations { inseparable_from: &[&VOLTAGE_OFFSET], ..Relations::uneven(&DEAD_ZONE, &SHIFTS) },
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.dead_pos += p[0];
        plant.dead_neg += p[1];
        plant.dead_softness = plant.dead_softness.max(p[2]);
    },
    ..Effect::USUAL
};
