//! Data whose truth is known: a reference plant that shares no line with [`crate::system::plant`], and cases drawn from it.

pub mod cases;
pub mod reference_plant;
