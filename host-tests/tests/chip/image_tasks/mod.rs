//! The image's own modules that know no chip, on the host: control tick and start, around a board that is a few fields.

pub mod names;
mod rig;
mod starts;
mod ticks;

#[allow(dead_code, unreachable_pub, reason = "the tests use some of it")]
#[path = "../../../../src/image"]
mod image {
    pub mod boot;
    pub mod tick;

    pub mod board {
        mod interface;

        pub use interface::{Board, Drive, Idle, Line};

        pub const AXES: usize = 2;
    }
}
