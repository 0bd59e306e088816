//! # truing: a model that learns what it is missing
//!
//! The gap workflow, top to bottom:
//!
//! ```text
//! log → simulate → residual → localise → name → extend → report
//! ```

pub mod exhibit;
pub mod outcome;
pub mod report;
