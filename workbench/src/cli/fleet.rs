//! `truing fleet`: many logs of many motors. Its commands are those of the crate `truing-fleet`.

pub use truing_fleet::commands::{Arguments, run};
