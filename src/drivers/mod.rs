//! Drivers: what stands between the numbers of a control tick and the registers of a board.
//!
//! ```text
//! counter → encoder ┐                              ┌ bridge → two PWM lines, enable line
//! converter → sense ┴→ Sample → Axis::step → Output ┘
//! ```
//!
//! Each driver is generic over the traits of `embedded-hal` 1.0, or over a small trait of its own where that has none
//! (counters, converters). They hold no register and no chip, so they run on the host, where they are tested against
//! mocks; a board supplies the pins and registers behind the traits.

pub mod axes;
pub mod axis;
pub mod bit_bang;
pub mod bridge;
pub mod drv8301;
pub mod encoder;
pub mod flash;
pub mod gates;
pub mod hardware;
pub mod interlock;
mod newest;
mod page;
pub mod parts;
pub mod reach;
pub mod saving;
pub mod scales;
pub mod sense;
pub mod zero;
