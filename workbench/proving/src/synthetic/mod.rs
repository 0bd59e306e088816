//! Data whose truth is known: a reference plant that shares no line with [`truing_core::system::plant`], and cases drawn from it.

pub mod cases;
/// The truth: a crate of its own, which no line of the plant that fits can enter.
pub use reference_plant;
