//! What travels between a servo and its host: messages and frames, the inbox of requests, and the record of a motion.

pub mod board;
pub mod capture;
pub mod in_force;
pub mod inbox;
pub mod protocol;
pub mod trial;
