//! # The truth: a motor simulated to a tolerance, with every switching located
//!
//! The plant with which `truing` fits trades exactness for speed. A test that simulated its data with that same plant would
//! only prove that the plant agrees with itself. This second integrator shares no line with it, and is a crate of its own so
//! that it cannot:
//!
//! ```text
//! command → delay → drive ([`drive`]) → winding → rotor and load (equations of [`motor`]) → sensors ([`sensors`])
//! ```
//!
//! The equations are smooth pieces joined by switchings: a shaft sticks or slips, a current reaches its limit, teeth
//! touch. Inside a piece an L-stable Rosenbrock method with error control advances the state ([`rosenbrock`]), so a small
//! inductance or a stiff contact costs nothing extra. Where a piece ends, the time is located to rounding, the step is
//! shortened to it and the next piece begins ([`modes`], [`simulator`]).
//!
//! Use [`Simulator::step`] in lock-step with a controller, or [`record::simulate`] for a whole log.

pub mod drive;
mod equations;
pub mod friction;
pub mod modes;
pub mod motor;
pub mod noise;
pub mod record;
pub mod rosenbrock;
pub mod sensors;
pub mod simulator;
pub mod state;
mod switching;

pub use drive::{Command, Decay, Drive, Knee};
pub use friction::{Bristle, Friction};
pub use motor::{Law, Load, Motor, Oddity, Split, Thermal, Train};
pub use sensors::{Converter, Encoder, Tacho};
pub use simulator::{Reading, Simulator};
