//! What the control interrupt runs in every tick, compiled for speed in an image that is compiled for size.
//!
//! The compiler translates a function that is `#[inline]` wherever it is called, with the optimisation of the calling package.
//! This package alone has `opt-level = 2`: what it reaches through such functions is fast, and everything else of the library
//! is small (docs/decisions/0320-size-but-for-the-tick.md).
#![no_std]
#![forbid(unsafe_code)]
#![cfg(target_os = "none")]

pub mod constants;

use constants::Constants;
use servo::axis::Sample;
use servo::axis::servo_axis::{self, Advance};

/// An axis of the image. It owns its state, and points to its constants.
pub type ServoAxis = servo_axis::ServoAxis<Constants>;

/// [`ServoAxis::advance`].
// Not into its caller, which is compiled for size.
#[inline(never)]
pub fn advance(axis: &mut ServoAxis, sample: Sample) -> Advance<'_> {
    axis.advance(sample)
}
