//! The host's side of the servo: the link, the motors it can drive, sessions, and the subcommands that use them.

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
extern crate truing_report;

pub mod commands;
pub mod device;
