//! # truing: a model that learns what it is missing
//!
//! The gap workflow, top to bottom:
//!
//! ```text
//! log → simulate → residual → localise → name → extend → report
//! ```

pub mod commands;
pub mod effects;
pub mod exhibit;
pub mod input_error;
pub mod log;
pub mod model;
pub mod outcome;
pub mod plant;
pub mod report;
pub mod steady;
pub mod truth;
