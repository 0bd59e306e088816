//! The loop that closes itself, on a servo without a chip: hours of motion in seconds.

mod command;
mod commissioned;
mod load;
mod rig;
mod undone;
