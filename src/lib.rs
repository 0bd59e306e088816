//! # servo: a brushed-DC servo that learns its own dead zone
//!
//! One control tick, top to bottom (see [`axis::Axis::step`]):
//!
//! ```text
//! encoder → speed → identify → control → compensate → PWM
//! ```
//!
//! Every stage has the same shape: a [`config::Config`] in SI units is checked and turned into fixed-point
//! `Params` once, a small `State` changes, and `step(&self, &mut State, input) -> output` does bounded integer work.
//! The library holds no pin, no clock, no logger and no chip, and it is `no_std` on the host too, so the host and the
//! chip compute the same bits.
//!
//! Start at [`axis::Axis`]. `examples/axis_on_the_host.rs` commissions a simulated motor and moves it;
//! `examples/in_your_firmware.rs` puts an axis into another firmware.
#![no_std]
#![forbid(unsafe_code)]

pub mod axis;
pub mod commission;
pub mod compensate;
pub mod config;
pub mod control;
pub mod drivers;
pub mod encoder;
pub mod identify;
pub mod link;
pub mod motion;
pub mod optional;
pub mod protect;
pub mod pwm;
pub mod record;
pub mod sample;
pub mod store;
pub mod units;
