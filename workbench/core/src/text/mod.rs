//! Sentences for people: why an input is unusable, and numbers as text.

pub mod figures;
pub mod input_error;
