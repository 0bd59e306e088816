//! The found model where people simulate: files of other programs written from a model file, and a nominal model read out of one.
//!
//! ```text
//! model → what the format holds → file, helper, ranges
//!       → what it cannot hold  → its cost on a log
//! ```

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
extern crate truing_report;

pub mod commands;
pub mod constants;
pub mod cost;
pub mod held;
pub mod helper;
pub mod import;
pub mod made;
pub mod mjcf;
pub mod numbers;
pub mod plan;
pub mod ranges;
pub mod urdf;
