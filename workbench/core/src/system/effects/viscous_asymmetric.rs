//! Viscous friction, in addition to the model's, that differs between the two directions.

use super::*;

/// The effect.
pub static VISCOUS_ASYMMETRIC: Effect = Effect {
    name: "viscous_asymmetric",
    summary: "additional viscous friction, different in the two directions",
    equation: "T = −pos·ω for ω > 0, −neg·ω for ω < 0",
    source: "Janot, Gautier, Brunot: EMPS reference models, 2019",
    signature: "missing torque linear in speed, with different slopes for the two directions",
    confusable_with: &[&VISCOUS_FRICTION, &COULOMB_ASYMMETRIC, &QUADRATIC_DRAG],
    separated_by: "staircases in both directions",
    parameters: &[
        Parameter::new("pos_nms", "N m s/rad", Scale::Viscous, -0.6, 4.0),
        Parameter::new("neg_nms", "N m s/rad", Scale::Viscous, -0.6, 4.0),
    ],
    starts: Starts::Grid(&[&[0.05, -0.05], &[-0.05, 0.05], &[0.2, 0.05], &[0.05, 0.2]]),
    family: Family::Viscous,
    domain: Domain::FastMotion,
    form: Form::Rich,
    offered: Offered::Both(Steady::new(Role::Refinement, Shape::Own).needs(Needs::Reversal)),
    relations: Relations { inseparable_from: &[&VISCOUS_FRICTION], ..Relations::NONE },
    on_chip: OnChip::Known,
    apply: |p, plant| {
        plant.viscous_pos += p[0];
        plant.viscous_neg += p[1];
    },
    ..Effect::USUAL
};
