//! Which calls of control, link and idle can end in a panic? Answered by the linked image itself, not by its sources: the
//! optimiser has removed most checks, and only what is left matters.
//!
//! The walk follows direct calls and branches between functions ([`thumb`]). A call by register is
//! followed where the code loads the address of a function just before ([`constants`]); any other is listed like a panic and
//! needs a reason as well. Every finding must stand in a checked-in list ([`accepted`]).
//!
//! The same calls bound the depth of the stack ([`stack`]).

pub mod accepted;
pub mod constants;
pub mod image;
pub mod stack;
pub mod thumb;
pub mod walk;
