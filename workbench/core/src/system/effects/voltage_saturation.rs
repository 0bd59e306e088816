//! Limit of the input behind the dead zone. `softness` 0 is a hard knee; above it the knee is rounded
//! (compression).

use super::*;

/// The effect.
pub static VOLTAGE_SATURATION: Effect = Effect {
    name: "voltage_saturation",
    summary: "the input is clamped to a limit, hard or with a rounded knee",
    equation: "v = clamp(u, ±limit); soft: v = u/(1 + |u/limit|^(1/s))^s",
    source: "Tao, Kokotović: Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996; rounded knee: Rapp, ESA SP-332, 1991",
    signature: "missing torque only at |u| above the limit",
    confusable_with: &[&CURRENT_LIMIT, &SPEED_SATURATION, &SUPPLY_SAG, &DRIVE_GAIN],
    separated_by: "sine or chirp at full amplitude; a release from full input to half: a clamped sensor stays flat for a while",
    parameters: &[
        Parameter::new("limit_v", "V", Scale::Input, 0.03, 1.5),
        Parameter::new("softness", "1", Scale::One, 0.0, 1.0).optional(0.0).unknown_on_chip(),
    ],
    starts: Starts::Quantiles(Signal::Input, &[0.0]),
    family: Family::Limit,
    domain: Domain::LargeInputs,
    offered: Offered::Both(Steady::new(Role::Representative, Shape::Limit)),
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.limit = plant.limit.min(p[0]);
        plant.limit_softness = plant.limit_softness.max(p[1]);
    },
    ..Effect::USUAL
};

/// Different for the two directions. It is offered for steady-state tables only, where it is seeded from the symmetric
/// form, so it has no starts of its own.
pub static VOLTAGE_SATURATION_ASYMMETRIC: Effect = Effect {
    name: "voltage_saturation_asymmetric",
    summary: "the input is clamped to different limits in the two directions, hard or with a rounded knee",
    equation: "v = u clamped to −neg … pos; soft: v = u/(1 + |u/limit|^(1/s))^s with the limit of the direction",
    source: VOLTAGE_SATURATION.source,
    signature: "missing torque only beyond the limits, which differ between the directions",
    confusable_with: &[&VOLTAGE_SATURATION, &SUPPLY_SAG, &VISCOUS_ASYMMETRIC],
    separated_by: VOLTAGE_SATURATION.separated_by,
    parameters: &[
        Parameter::new("pos_v", "V", Scale::Input, 0.03, 1.5),
        Parameter::new("neg_v", "V", Scale::Input, 0.03, 1.5),
        Parameter::new("softness", "1", Scale::One, 0.0, 1.0).optional(0.0).unknown_on_chip(),
    ],
    starts: Starts::Grid(&[]),
    family: Family::Limit,
    domain: Domain::LargeInputs,
    form: Form::Rich,
    offered: Offered::Tables(Steady::new(Role::Representative, Shape::Limit).needs(Needs::Reversal)),
    relations: Relations::uneven(&VOLTAGE_SATURATION, &[]),
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.limit = plant.limit.min(p[0]);
        plant.limit_skew = p[1] / p[0];
        plant.limit_softness = plant.limit_softness.max(p[2]);
    },
    ..Effect::USUAL
};
