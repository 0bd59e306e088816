//! One file a subcommand.

pub mod bench;
pub mod cases;
pub mod demo;
pub mod instructions;
pub mod judge;
pub mod paper;
pub mod rig;
