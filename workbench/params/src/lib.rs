//! From a model with its effects to what the servo takes: `truing params`, and the candidates of the loop.

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
extern crate truing_report;

pub mod candidate;
pub mod command;
pub mod compensation;
pub mod waves;
