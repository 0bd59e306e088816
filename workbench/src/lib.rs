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
pub mod screen;

pub mod axis_file;
pub mod bench;
pub mod cases;
pub mod commands;
pub mod commission_report;
pub mod compensation;
pub mod demo;
pub mod effects;
pub mod estimate;
pub mod evidence;
pub mod excitation;
pub mod exhibit;
pub mod experiment;
pub mod feasible;
pub mod files;
pub mod fit;
pub mod gap;
pub mod hypothesis;
pub mod input_error;
pub mod interrupt;
pub mod judge;
pub mod localise;
pub mod log;
pub mod loops;
pub mod model;
pub mod motor;
pub mod outcome;
pub mod paper;
pub mod parameters;
pub mod plant;
pub mod plots;
pub mod prediction;
pub mod replay;
pub mod report;
pub mod residual;
pub mod run_log;
pub mod search;
pub mod servo_link;
pub mod session;
pub mod setup;
pub mod starts;
pub mod steady;
pub mod structure;
pub mod time_base;
pub mod tracking;
pub mod truth;
pub mod verdict;
pub mod view;
pub mod volts;
pub mod waypoints;
