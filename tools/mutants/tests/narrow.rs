//! What the test room `chip` of `host-tests` tests without the workbench, which takes minutes to build: `cargo xtask mutants`
//! builds and runs this for every mutant.

// What the room and the image's modules call by these names.
extern crate self as defmt;
extern crate self as fast_tick;
extern crate self as trials;

#[allow(clippy::duplicate_mod, reason = "the pin table is tested by itself and as part of the chip's code")]
#[path = "../../../host-tests/tests/chip"]
mod chip {
    pub mod axes;
    pub mod board_model;
    mod board_pins;
    mod compensate;
    mod drivers;
    mod gates;
    pub mod image_tasks;
    mod protect;
    mod reach;
    mod units;
}
#[allow(dead_code, unreachable_pub, reason = "the narrow room needs the configuration alone")]
#[path = "../../../trials/src/simulated_servo.rs"]
mod simulated_servo;

use chip::board_model;
use chip::image_tasks::names::{ServoAxis, advance, constants, info};
