//! The parts of the firmware image. All but the entry, one file a chip, know neither chip nor board.

mod board;
mod boot;
mod idle_task;
mod last_resort;
mod link_task;
mod memory;
mod start;
mod tick;

#[cfg(chip = "stm32f405")]
mod stm32f405;
