//! A servo and what is worked out for one: the link to it, sessions, its parameters and files, records of its motion.
//!
//! Nothing here imports the gap workflow.

pub mod aftermath;
pub mod axis_file;
pub mod board;
pub mod commission_report;
mod commission_seen;
pub mod feasible;
pub mod link;
pub mod loops;
pub mod motion_profile;
pub mod motor;
pub mod parameters;
pub mod place_load;
pub mod replay;
pub mod run_log;
pub mod session;
pub mod setup;
pub mod tracking;
pub mod waypoints;
