//! The loop that closes itself: record a motor, name what its model lacks, compensate it, measure again, keep or roll back.
//!
//! ```text
//! in force → record → gap → name → candidate in RAM → paired trial → store, or old parameters again
//! ```

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
extern crate truing_report;

pub mod bench;
pub mod commands;
pub mod history;
pub mod improving;
pub mod motions;
pub mod record;
pub mod recording;
pub mod report;
pub mod shared;
pub mod trial;

pub use truing_params::candidate;
