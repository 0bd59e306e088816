//! The proving ground: drawn cases with hidden effects, rigs with known answers, the demo, and what a search costs.

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
extern crate truing_report;

pub mod commands;
pub mod synthetic;
