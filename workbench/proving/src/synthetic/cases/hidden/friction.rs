//! Friction of the rotor.

use super::{Group, Kind, unequal};
use crate::synthetic::cases::base::{Natural, log_range};
use crate::synthetic::reference_plant::{Bristle, Friction, Motor};
use rand::RngExt;
use truing_core::system::effects;

/// Elastic asperities: 0.02 to 0.2 % of the way in one time constant, lightly damped.
fn bristle(shape: f64, natural: &Natural, level: f64, inertia: f64) -> Bristle {
    let deflection_rad = 2e-4 * 10f64.powf(shape) * natural.speed * natural.tau;
    Bristle { deflection_rad, damping: 0.3 * (level / deflection_rad * inertia).sqrt() }
}

fn dry_friction(motor: &mut Motor, friction: Friction, shape: Option<f64>, natural: &Natural) {
    let level = 0.5 * (friction.kinetic_nm[0] + friction.kinetic_nm[1]);
    let bristle = shape.map(|shape| bristle(shape, natural, level, motor.inertia));
    motor.friction = Friction { bristle, ..friction };
}

pub(super) static COULOMB_FRICTION: Kind = Kind::new(
    &effects::COULOMB_FRICTION,
    |rng, n| vec![log_range(rng, 0.003, 0.2) * n.torque],
    |v, shape, n, subject| dry_friction(&mut subject.motor, Friction::coulomb(v[0]), shape, n),
)
.of(Group::DryFriction)
.in_other_forms();

pub(super) static COULOMB_ASYMMETRIC: Kind = Kind::new(
    &effects::COULOMB_ASYMMETRIC,
    |rng, n| {
        let level = log_range(rng, 0.01, 0.2) * n.torque;
        unequal(rng, level)
    },
    |v, shape, n, subject| {
        let friction = Friction { kinetic_nm: [v[0], v[1]], ..Friction::default() };
        dry_friction(&mut subject.motor, friction, shape, n);
    },
)
.of(Group::DryFriction)
.in_other_forms();

pub(super) static STRIBECK_FRICTION: Kind = Kind::new(
    &effects::STRIBECK_FRICTION,
    |rng, n| {
        let level = log_range(rng, 0.005, 0.15) * n.torque;
        vec![level, level * rng.random_range(1.3..2.0), log_range(rng, 0.01, 0.1) * n.speed]
    },
    |v, shape, n, subject| {
        let friction =
            Friction { breakaway_ratio: v[1] / v[0], stribeck_rad_s: v[2], ..Friction::coulomb(v[0]) };
        dry_friction(&mut subject.motor, friction, shape, n);
    },
)
.of(Group::DryFriction)
.in_other_forms();

pub(super) static LOAD_DEPENDENT_FRICTION: Kind = Kind::new(
    &effects::LOAD_DEPENDENT_FRICTION,
    |rng, n| vec![log_range(rng, 0.01, 0.08) * n.torque, log_range(rng, 0.03, 0.35), 0.0],
    |v, _, _, subject| {
        subject.motor.friction =
            Friction { per_motor_torque: v[1], per_load_torque: v[2], ..Friction::coulomb(v[0]) };
    },
)
.of(Group::DryFriction);

pub(super) static VISCOUS_ASYMMETRIC: Kind = Kind::new(
    &effects::VISCOUS_ASYMMETRIC,
    |rng, n| {
        let more = log_range(rng, 0.02, 0.6) * n.torque / n.speed;
        unequal(rng, more)
    },
    |v, _, _, subject| {
        let [forward, backward] = subject.motor.viscous;
        subject.motor.viscous = [forward + v[0], backward + v[1]];
    },
)
.of(Group::Base);

pub(super) static QUADRATIC_DRAG: Kind = Kind::new(
    &effects::QUADRATIC_DRAG,
    |rng, n| vec![log_range(rng, 0.01, 0.6) * n.torque / n.speed.powi(2)],
    |v, _, _, subject| subject.motor.drag = v[0],
);
