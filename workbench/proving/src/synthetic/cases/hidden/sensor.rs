//! Imperfect speed sensors.

use super::{Group, Kind, sign, wrong_ratio};
use crate::synthetic::cases::base::log_range;
use truing_core::system::effects;

pub(super) static ENCODER_SCALE: Kind =
    Kind::new(&effects::ENCODER_SCALE, wrong_ratio, |v, _, _, subject| subject.reading_scale = v[0])
        .of(Group::Scale);

pub(super) static SPEED_SATURATION: Kind = Kind::new(
    &effects::SPEED_SATURATION,
    |rng, n| vec![(1.0 - log_range(rng, 0.01, 0.6)) * n.speed],
    |v, _, _, subject| subject.tacho().limit_rad_s = v[0],
)
.behind_tacho();

pub(super) static SENSOR_LAG: Kind = Kind::new(
    &effects::SENSOR_LAG,
    |rng, n| vec![log_range(rng, 0.01, 0.6) * n.tau],
    |v, _, _, subject| subject.tacho().lag_s = v[0],
)
.of(Group::Delay)
.behind_tacho();

pub(super) static SENSOR_RECTIFIED: Kind =
    Kind::new(&effects::SENSOR_RECTIFIED, |_, _| vec![], |_, _, _, subject| subject.tacho().rectified = true)
        .behind_tacho();

pub(super) static SENSOR_OFFSET: Kind = Kind::new(
    &effects::SENSOR_OFFSET,
    |rng, n| vec![sign(rng) * log_range(rng, 0.003, 0.1) * n.speed],
    |v, _, _, subject| subject.reading_offset = v[0],
)
.of(Group::Constant)
.behind_tacho();
