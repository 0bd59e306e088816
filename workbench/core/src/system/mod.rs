//! The simulated system: its model, the plant that the model describes, the effects that a model may lack, and the logs
//! that it is compared with.

pub mod effects;
pub mod log;
pub mod model;
pub mod plant;
pub mod threads;
