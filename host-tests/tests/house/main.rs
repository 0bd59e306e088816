//! The house itself: documents that keep their word, and rules about what a source must not contain.

mod documents;
mod invariants;
