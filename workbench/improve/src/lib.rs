//! The loop that closes itself: record a motor, name what its model lacks, compensate it, measure again, keep or roll back.

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
extern crate truing_report;

pub mod commands;
pub mod record;
