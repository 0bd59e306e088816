//! Motors that are not as their model file says.

use super::{Group, Kind, wrong_ratio};
use crate::synthetic::cases::base::log_range;
use crate::synthetic::reference_plant::Thermal;
use rand::RngExt;
use truing_core::system::effects;

pub(super) static RESISTANCE: Kind =
    Kind::new(&effects::RESISTANCE, wrong_ratio, |v, _, _, subject| subject.motor.resistance_ohm *= v[0])
        .of(Group::Base);

pub(super) static MOTOR_GAIN: Kind = Kind::new(&effects::MOTOR_GAIN, wrong_ratio, |v, _, _, subject| {
    subject.motor.torque_constant *= v[0];
    subject.motor.emf_constant *= v[0];
})
.of(Group::Base);

pub(super) static INERTIA: Kind =
    Kind::new(&effects::INERTIA, wrong_ratio, |v, _, _, subject| subject.motor.inertia *= v[0])
        .of(Group::Base);

pub(super) static VISCOUS_FRICTION: Kind = Kind::new(
    &effects::VISCOUS_FRICTION,
    |rng, n| {
        // b is often wrong by a factor.
        let size = rng.random_range((4.5 * n.tolerance).ln_1p()..5.0_f64.ln());
        vec![(if rng.random_bool(0.7) { size } else { -size }).exp()]
    },
    |v, _, _, subject| subject.motor.viscous = subject.motor.viscous.map(|b| b * v[0]),
)
.of(Group::Base);

pub(super) static THERMAL_RESISTANCE: Kind = Kind::new(
    &effects::THERMAL_RESISTANCE,
    |rng, n| {
        let power = 0.1 * n.volts * n.current;
        vec![log_range(rng, 0.05, 1.0) / power, log_range(rng, 5.0, 150.0) * n.tau]
    },
    |v, _, _, subject| {
        subject.motor.thermal = Some(Thermal { rise_per_w: v[0], time_constant_s: v[1] });
    },
);

pub(super) static KT_SATURATION: Kind = Kind::new(
    &effects::KT_SATURATION,
    |rng, n| vec![log_range(rng, 0.5, 5.0) * n.current],
    |v, shape, _, subject| {
        subject.motor.torque_knee_a = v[0];
        subject.motor.torque_knee_order = shape.map_or(1.0, |shape| 0.4 + 0.4 * shape);
    },
)
.in_other_forms();
