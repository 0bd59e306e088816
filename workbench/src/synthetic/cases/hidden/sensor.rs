//! Imperfect speed sensors.

use super::{Group, Kind, sign, wrong_ratio};
use crate::synthetic::cases::base::log_range;
use crate::system::effects;

pub(super) static ENCODER_SCALE: Kind = Kind {
    effect: &effects::ENCODER_SCALE,
    parameters: &["ratio"],
    group: Group::Scale,
    needs_tacho: false,
    has_other_form: false,
    draw: wrong_ratio,
    put: |v, _, _, subject| subject.reading_scale = v[0],
};

pub(super) static SPEED_SATURATION: Kind = Kind {
    effect: &effects::SPEED_SATURATION,
    parameters: &["limit_rad_s"],
    group: Group::Own,
    needs_tacho: true,
    has_other_form: false,
    draw: |rng, n| vec![(1.0 - log_range(rng, 0.01, 0.6)) * n.speed],
    put: |v, _, _, subject| subject.tacho().limit_rad_s = v[0],
};

pub(super) static SENSOR_LAG: Kind = Kind {
    effect: &effects::SENSOR_LAG,
    parameters: &["time_constant_s"],
    group: Group::Delay,
    needs_tacho: true,
    has_other_form: false,
    draw: |rng, n| vec![log_range(rng, 0.01, 0.6) * n.tau],
    put: |v, _, _, subject| subject.tacho().lag_s = v[0],
};

pub(super) static SENSOR_RECTIFIED: Kind = Kind {
    effect: &effects::SENSOR_RECTIFIED,
    parameters: &[],
    group: Group::Own,
    needs_tacho: true,
    has_other_form: false,
    draw: |_, _| vec![],
    put: |_, _, _, subject| subject.tacho().rectified = true,
};

pub(super) static SENSOR_OFFSET: Kind = Kind {
    effect: &effects::SENSOR_OFFSET,
    parameters: &["offset"],
    group: Group::Constant,
    needs_tacho: true,
    has_other_form: false,
    draw: |rng, n| vec![sign(rng) * log_range(rng, 0.003, 0.1) * n.speed],
    put: |v, _, _, subject| subject.reading_offset = v[0],
};
