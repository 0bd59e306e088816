//! # truing: a model that learns what it is missing
//!
//! The gap workflow, top to bottom:
//!
//! ```text
//! log → simulate → residual → localise → name → extend → report
//! ```

#![deny(clippy::print_stdout, clippy::print_stderr)]

// First, for its macros.
#[macro_use]
pub mod console;

pub mod cli;
pub mod device;
pub mod gap;
pub mod outcome;
pub mod report;
pub mod synthetic;
pub mod system;
