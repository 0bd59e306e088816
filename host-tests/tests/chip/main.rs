//! The parts of the chip one by one, on the host: arithmetic, set-points, drivers, the pin table, and small doses for Miri.

#![allow(clippy::duplicate_mod, reason = "the pin table is tested by itself and as part of the chip's code")]

mod axes;
#[cfg(all(target_os = "linux", target_arch = "x86_64", not(miri)))]
mod board_model;
mod board_pins;
mod compensate;
mod control_trajectory;
mod drivers;
mod far;
mod fixed_vs_f64;
mod gates;
#[cfg(all(target_os = "linux", target_arch = "x86_64", not(miri)))]
mod image_tasks;
mod miri;
mod observer;
mod position_load;
mod protect;
mod reach;
mod units;

// What the image's modules call by these names.
extern crate self as defmt;
extern crate self as fast_tick;
#[cfg(all(target_os = "linux", target_arch = "x86_64", not(miri)))]
use image_tasks::names::{ServoAxis, advance, constants, info};
