//! Imperfect speed sensors.

use super::{Kind, sign, wrong_ratio};
use crate::synthetic::cases::base::log_range;

pub(super) static ENCODER_SCALE: Kind = Kind {
    name: "encoder_scale",
    parameters: &["ratio"],
    group: "scale",
    needs_tacho: false,
    has_other_form: false,
    draw: wrong_ratio,
    put: |v, _, _, subject| subject.reading_scale = v[0],
};

pub(super) static SPEED_SATURATION: Kind = Kind {
    name: "speed_saturation",
    parameters: &["limit_rad_s"],
    group: "clamp",
    needs_tacho: true,
    has_other_form: false,
    draw: |rng, n| vec![(1.0 - log_range(rng, 0.01, 0.6)) * n.speed],
    put: |v, _, _, subject| subject.tacho().limit_rad_s = v[0],
};

pub(super) static SENSOR_LAG: Kind = Kind {
    name: "sensor_lag",
    parameters: &["time_constant_s"],
    group: "delay",
    needs_tacho: true,
    has_other_form: false,
    draw: |rng, n| vec![log_range(rng, 0.01, 0.6) * n.tau],
    put: |v, _, _, subject| subject.tacho().lag_s = v[0],
};

pub(super) static SENSOR_RECTIFIED: Kind = Kind {
    name: "sensor_rectified",
    parameters: &[],
    group: "rectified",
    needs_tacho: true,
    has_other_form: false,
    draw: |_, _| vec![],
    put: |_, _, _, subject| subject.tacho().rectified = true,
};

pub(super) static SENSOR_OFFSET: Kind = Kind {
    name: "sensor_offset",
    parameters: &["offset"],
    group: "constant",
    needs_tacho: true,
    has_other_form: false,
    draw: |rng, n| vec![sign(rng) * log_range(rng, 0.003, 0.1) * n.speed],
    put: |v, _, _, subject| subject.reading_offset = v[0],
};
