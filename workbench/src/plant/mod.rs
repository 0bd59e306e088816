//! The plant.
pub mod physics;
