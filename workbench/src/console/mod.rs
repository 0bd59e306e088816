//! What a person types and reads: errors about inputs, text on the screen, the interruption of a command.

#[macro_use]
pub mod screen;

pub mod input_error;
pub mod interrupt;
