//! The parts of the firmware image.

pub mod board;
pub mod boot;
mod last_resort;
pub mod link_task;
mod memory;
pub mod tick;
