//! What stands for the packages `fast-tick` and `defmt`, which exist for the chip alone.

use servo::axis::Sample;
use servo::axis::servo_axis::{self, Advance};

pub type ServoAxis = servo_axis::ServoAxis<constants::Constants>;

pub fn advance(axis: &mut ServoAxis, sample: Sample) -> Advance<'_> {
    axis.advance(sample)
}

pub mod constants {
    use servo::axis::Axis;

    pub type Constants = std::sync::Arc<Axis>;

    pub fn put(axis: Axis) -> Result<Constants, ()> {
        Ok(Constants::new(axis))
    }
}

macro_rules! quiet {
    ($text:literal $(, $value:expr)*) => {{
        $(let _ = &$value;)*
    }};
}
pub(crate) use quiet as info;
