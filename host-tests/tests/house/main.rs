//! The code base itself, held to its figures (`cargo xtask house` prints them all), to what its sources must not contain,
//! and to what its documents promise.

mod constants;
mod documents;
mod figures;
mod invariants;
mod pages;
mod rooms;
mod skips;
