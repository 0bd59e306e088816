//! One file a subcommand.

pub mod capture;
pub mod commission;
pub mod firmware;
pub mod monitor;
pub mod move_to;
pub mod profile;
pub mod replay;
pub mod track;
