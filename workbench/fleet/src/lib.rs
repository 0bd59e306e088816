//! Fleets: many motors of one kind, each with many logs.
//!
//! ```text
//! manifest → one task a log (check) → one result file a log → spread, drift, steps, new effects → page
//! ```
//!
//! Whatever runs the tasks (this machine, Ray, Dask) holds nothing: results are files, and a file holds nothing that differs from run
//! to run. A run that was killed is started again.

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
extern crate truing_report;

pub mod appeared;
pub mod check;
pub mod commands;
pub mod findings;
pub mod generator;
pub mod ingest;
pub mod manifest;
pub mod moment;
pub mod page;
pub mod series;
pub mod stats;
pub mod store;
