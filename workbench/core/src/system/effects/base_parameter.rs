//! A base parameter of the model that is wrong by more than its tolerance allows. As a candidate it is freed from
//! its prior.

use super::*;

/// What they have in common: a factor on a number of the winding.
const RATIO: Effect = Effect {
    source: "Krishnan: Electric Motor Drives, 2001",
    parameters: &[Parameter::new("ratio", "1", Scale::One, 0.1, 10.0).meaning(Meaning::Ratio)],
    starts: Starts::Grid(&[&[0.5], &[0.7], &[0.85], &[1.15], &[1.4], &[2.0]]),
    axis: Axis::Winding,
    form: Form::Absorbed,
    offered: Offered::Both(Steady::new(Role::Rival, Shape::Slope)),
    on_chip: OnChip::Known,
    ..Effect::USUAL
};

/// The resistance is not what the model says.
pub static RESISTANCE: Effect = Effect {
    name: "resistance",
    summary: "the resistance is not what the model says",
    equation: "R = ratio·R_model",
    signature: "missing torque follows the current",
    confusable_with: &[&INERTIA, &MOTOR_GAIN, &SUPPLY_SAG, &DRIVE_GAIN],
    separated_by: "log the current",
    relations: Relations { multiplies: Some(Multiplies::base("R_ohm")), ..Relations::NONE },
    apply: |p, plant| plant.resistance *= p[0],
    ..RATIO
};

/// The motor constant is not what the model says (Kt and Ke together).
pub static MOTOR_GAIN: Effect = Effect {
    name: "motor_gain",
    summary: "the motor constant is not what the model says (Kt and Ke together)",
    equation: "Kt = ratio·Kt_model, Ke = ratio·Ke_model",
    signature: "gain and time constant move oppositely",
    confusable_with: &[&DRIVE_GAIN, &VISCOUS_FRICTION, &RESISTANCE],
    separated_by: "square reversals and coast-downs; log the current",
    relations: Relations { multiplies: Some(Multiplies::base("Kt_nm_per_a")), ..Relations::NONE },
    apply: |p, plant| {
        plant.kt *= p[0];
        plant.ke *= p[0];
    },
    ..RATIO
};

/// The inertia is not what the model says.
pub static INERTIA: Effect = Effect {
    name: "inertia",
    summary: "the inertia is not what the model says",
    equation: "J = ratio·J_model",
    signature: "residual follows the acceleration",
    confusable_with: &[&RESISTANCE, &TRANSPORT_DELAY, &ACTUATOR_LAG],
    separated_by: "coast-downs against driven accelerations; log the current",
    axis: Axis::Any,
    offered: Offered::Records(InTables::Counts),
    relations: Relations {
        multiplies: Some(Multiplies::Base { key: "J_kgm2", linear_key: "mass_kg" }),
        ..Relations::NONE
    },
    apply: |p, plant| plant.inertia *= p[0],
    ..RATIO
};

/// The viscous friction is not what the model says.
pub static VISCOUS_FRICTION: Effect = Effect {
    name: "viscous_friction",
    summary: "the viscous friction is not what the model says",
    equation: "b = ratio·b_model",
    signature: "missing torque linear in speed",
    confusable_with: &[&MOTOR_GAIN, &QUADRATIC_DRAG, &COULOMB_FRICTION],
    separated_by: "square reversals and coast-downs",
    parameters: &[Parameter::new("ratio", "1", Scale::One, 0.01, 50.0).meaning(Meaning::Ratio)],
    starts: Starts::Grid(&[&[0.1], &[0.5], &[2.0], &[5.0], &[15.0]]),
    axis: Axis::Any,
    family: Family::Viscous,
    domain: Domain::FastMotion,
    offered: Offered::Both(Steady::new(Role::Rival, Shape::Slope).needs(Needs::Winding)),
    relations: Relations { multiplies: Some(Multiplies::base("b_nms_per_rad")), ..Relations::NONE },
    apply: |p, plant| plant.viscous *= p[0],
    ..RATIO
};
