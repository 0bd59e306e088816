//! The code base itself, held to its figures: `cargo xtask house` prints them all.

mod figures;
mod rooms;
mod skips;
