//! Fault injection: a virtual motor breaks, and the verdict, its delay and the travel until then are noted.
//!
//! ```text
//! plant → commissioned bench → motion → injury at a random moment → bridge open → Finding
//! ```
//!
//! The motor is the truth's integrator ([`truing::synthetic::reference_plant`]), with a seized shaft as a piece of its own ([`world`]). The
//! clock of the requirement is the identified model, run beside ([`clock`]).

pub mod calm;
pub mod clock;
pub mod commissioning;
pub mod first_motion;
pub mod report;
pub mod trial;
pub mod world;
