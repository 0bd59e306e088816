//! What a person types and reads: errors about inputs, text on the screen, the interruption of a command.

#[macro_use]
pub mod screen;

pub mod files;
pub mod interrupt;
pub mod rows;
pub mod watched;
pub mod written;
