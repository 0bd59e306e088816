//! Loads, and what joins them to the motor.

use super::{Group, Kind, sign};
use crate::synthetic::cases::base::log_range;
use crate::synthetic::reference_plant::{Law, Split, Train};
use rand::RngExt;
use truing_core::system::effects;

pub(super) static CONSTANT_LOAD: Kind = Kind::new(
    &effects::CONSTANT_LOAD,
    |rng, n| vec![sign(rng) * log_range(rng, 0.003, 0.15) * n.torque],
    |v, _, _, subject| subject.motor.load.constant_nm = v[0],
)
.of(Group::Constant);

pub(super) static GRAVITY: Kind = Kind::new(
    &effects::GRAVITY,
    |rng, n| {
        let torque = log_range(rng, 0.005, 0.25) * n.torque * n.gear_ratio;
        vec![torque, rng.random_range(-std::f64::consts::PI..std::f64::consts::PI)]
    },
    |v, _, _, subject| {
        subject.motor.load.mgl_nm = v[0];
        subject.motor.load.gravity_phase = v[1];
    },
);

pub(super) static COGGING: Kind = Kind::new(
    &effects::COGGING,
    |rng, n| {
        let periods = f64::from(rng.random_range(2..=40));
        vec![log_range(rng, 0.01, 0.2) * n.torque, periods, rng.random_range(-3.0..3.0)]
    },
    |v, _, _, subject| {
        let load = &mut subject.motor.load;
        (load.cogging_nm, load.cogging_periods, load.cogging_phase) = (v[0], v[1], v[2]);
    },
);

pub(super) static PERIODIC_LOAD: Kind = Kind::new(
    &effects::PERIODIC_LOAD,
    |rng, n| {
        let frequency = log_range(rng, 0.1, 3.0) / n.tau;
        vec![log_range(rng, 0.005, 0.15) * n.torque, frequency, rng.random_range(-3.0..3.0)]
    },
    |v, _, _, subject| {
        let load = &mut subject.motor.load;
        (load.periodic_nm, load.periodic_hz, load.periodic_phase) = (v[0], v[1], v[2]);
    },
);

pub(super) static BACKLASH: Kind = Kind::new(
    &effects::BACKLASH,
    |rng, n| vec![log_range(rng, 0.005, 0.8) * n.speed * n.tau, rng.random_range(0.15..0.6)],
    |v, shape, n, subject| {
        // Teeth far stiffer than the motor: they catch the load without a rebound, or, in the other form, throw it back.
        // Friction acts on the motor's side, as in the library.
        let split = Split { inertia: v[1], viscous: 0.0 };
        let damping_ratio = shape.map_or(1.0, |shape| 0.8 - 0.4 * shape);
        let (reduced, rate) = (subject.motor.inertia * v[1] * (1.0 - v[1]), 150.0 / n.tau);
        let stiffness = reduced * rate.powi(2);
        subject.motor.train =
            Train::Play { split, gap_rad: v[0], stiffness, damping: 2.0 * damping_ratio * reduced * rate };
        // Referred to the shaft of the encoder, an encoder at the load means a gear ratio of 1.
        subject.encoder_at_load = n.gear_ratio == 1.0;
    },
)
.of(Group::Train)
.in_other_forms();

pub(super) static FLEXIBLE_COUPLING: Kind = Kind::new(
    &effects::FLEXIBLE_COUPLING,
    |rng, n| {
        let share = rng.random_range(0.2..0.7);
        let inertia = n.inertia * share * (1.0 - share);
        let frequency = log_range(rng, 3.0, 30.0) / n.tau;
        let damping = 2.0 * rng.random_range(0.02..0.2) * frequency * inertia;
        vec![inertia * frequency.powi(2), damping, share]
    },
    |v, _, _, subject| {
        let split = Split { inertia: v[2], viscous: 0.0 };
        subject.motor.train = Train::Flexible { split, stiffness: v[0], damping: v[1] };
    },
)
.of(Group::Train);

pub(super) static TORSIONAL_SPRING: Kind = Kind::new(
    &effects::TORSIONAL_SPRING,
    |rng, n| {
        let angle = n.speed * n.tau;
        let stiffness = log_range(rng, 0.001, 0.5) * n.torque / angle;
        let progressive = rng.random_bool(0.3);
        // The cubic part is as large as the linear one two to six such angles from rest.
        let as_large = rng.random_range(2.0..6.0) * angle;
        let cubic = if progressive { stiffness / (as_large * as_large) } else { 0.0 };
        vec![stiffness, rng.random_range(-2.0..2.0) * angle, cubic]
    },
    |v, _, _, subject| {
        subject.motor.load.law = Some(Law {
            torque: |p, theta| -(p[0] * (theta - p[1]) + p[2] * (theta - p[1]).powi(3)),
            parameters: v.to_vec(),
        });
    },
);
