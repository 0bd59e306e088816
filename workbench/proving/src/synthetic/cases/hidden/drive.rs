//! Imperfect drives: voltages that do not arrive, or arrive late.

use super::{Group, Kind, Subject, sign, unequal, wrong_ratio};
use crate::synthetic::cases::base::log_range;
use crate::synthetic::reference_plant::Knee;
use rand::RngExt;
use truing_core::system::effects;

fn dead_zone(widths: [f64; 2], shape: Option<f64>, subject: &mut Subject) {
    let drive = &mut subject.motor.drive;
    drive.dead_zone_v = widths;
    if let Some(shape) = shape {
        drive.dead_zone_knee = Knee::Logistic((0.02 + 0.08 * shape) * widths[0].min(widths[1]));
    }
}

pub(super) static DEAD_ZONE: Kind = Kind::new(
    &effects::DEAD_ZONE,
    |rng, n| vec![log_range(rng, 0.005, 0.25) * n.volts],
    |v, shape, _, subject| dead_zone([v[0]; 2], shape, subject),
)
.of(Group::DeadZone)
.in_other_forms();

pub(super) static DEAD_ZONE_ASYMMETRIC: Kind = Kind::new(
    &effects::DEAD_ZONE_ASYMMETRIC,
    |rng, n| {
        let width = log_range(rng, 0.01, 0.25) * n.volts;
        unequal(rng, width)
    },
    |v, shape, _, subject| dead_zone([v[0], v[1]], shape, subject),
)
.of(Group::DeadZone)
.in_other_forms();

pub(super) static VOLTAGE_SATURATION: Kind = Kind::new(
    &effects::VOLTAGE_SATURATION,
    |rng, n| {
        let softness = if rng.random_bool(0.3) { rng.random_range(0.1..0.4) } else { 0.0 };
        vec![(1.0 - log_range(rng, 0.01, 0.6)) * n.volts, softness]
    },
    |v, shape, n, subject| {
        let drive = &mut subject.motor.drive;
        drive.limit_v = [v[0]; 2];
        drive.limit_knee = match shape {
            Some(shape) => Knee::Logistic((0.02 + 0.06 * shape) * n.volts),
            None if v[1] > 0.0 => Knee::Compression(v[1]),
            None => Knee::Hard,
        };
    },
)
.in_other_forms();

pub(super) static DRIVE_GAIN: Kind =
    Kind::new(&effects::DRIVE_GAIN, wrong_ratio, |v, _, _, subject| subject.motor.drive.gain = [v[0]; 2])
        .of(Group::Scale);

pub(super) static VOLTAGE_OFFSET: Kind = Kind::new(
    &effects::VOLTAGE_OFFSET,
    |rng, n| vec![sign(rng) * log_range(rng, 0.003, 0.12) * n.volts],
    |v, _, _, subject| subject.motor.drive.offset_v = v[0],
)
.of(Group::Constant);

pub(super) static TRANSPORT_DELAY: Kind = Kind::new(
    &effects::TRANSPORT_DELAY,
    |rng, n| vec![log_range(rng, 0.005, 0.5) * n.tau],
    |v, _, _, subject| subject.motor.drive.delay_s = v[0],
)
.of(Group::Delay);

pub(super) static ACTUATOR_LAG: Kind = Kind::new(
    &effects::ACTUATOR_LAG,
    |rng, n| vec![log_range(rng, 0.01, 0.6) * n.tau],
    |v, _, _, subject| subject.motor.drive.lag_s = v[0],
)
.of(Group::Delay);

pub(super) static VOLTAGE_DROP: Kind = Kind::new(
    &effects::VOLTAGE_DROP,
    |rng, n| vec![log_range(rng, 0.005, 0.15) * n.volts],
    |v, _, _, subject| subject.motor.drive.drop_v = v[0],
);

pub(super) static SUPPLY_SAG: Kind = Kind::new(
    &effects::SUPPLY_SAG,
    |rng, n| vec![log_range(rng, 0.02, 0.6) * n.resistance],
    |v, shape, n, subject| {
        subject.motor.drive.source_ohm = v[0];
        // A capacitor across the bridge in place of a rail without memory.
        subject.motor.drive.bus_farad = shape.map_or(0.0, |shape| (0.005 + 0.03 * shape) * n.tau / v[0]);
    },
)
.in_other_forms();

pub(super) static CURRENT_LIMIT: Kind = Kind::new(
    &effects::CURRENT_LIMIT,
    |rng, n| vec![log_range(rng, 0.15, 1.2) * n.current],
    |v, _, _, subject| subject.motor.drive.current_limit_a = v[0],
);
