//! Power cuts at every flash operation: which set is read afterwards?

pub mod flash;
pub mod library;
pub mod sets;
pub mod suite;
