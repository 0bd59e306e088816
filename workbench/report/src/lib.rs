//! What a person sees: reports of a result, and the terminal.

#![deny(clippy::print_stdout, clippy::print_stderr)]

// First, for its macros.
#[cfg(feature = "console")]
#[macro_use]
pub mod console;

pub mod report;
