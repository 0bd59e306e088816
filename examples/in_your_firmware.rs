//! A servo inside of somebody else's firmware. It needs no operating system, no heap and no crate of a chip:
//!
//! ```text
//! cargo check --example in_your_firmware --target thumbv7em-none-eabihf
//! ```
//!
//! The firmware owns pins, timers and interrupts. It implements [`Board`] and calls [`Servo::control_interrupt`] at the
//! control rate.
#![no_std]

use servo::axis::{Axis, Bridge, Command, Refusal, Sample, State};
use servo::config::{Config, ConfigError};
use servo::protect::Fault;

/// What the servo needs of a board.
pub trait Board {
    /// Encoder count, and supply and current in converter counts, all read at the start of the tick.
    fn sample(&mut self) -> Sample;
    /// Writes the bridge. A duty of `pwm_full_scale` is all of the supply; it acts from the next tick on.
    fn drive(&mut self, bridge: Bridge, duty: i16);
}

/// An axis with its state and its board.
pub struct Servo<B> {
    axis: Axis,
    state: State,
    board: B,
}

impl<B: Board> Servo<B> {
    /// An axis that was just switched on: bridge open, nothing known. Names the field if a value is out of range.
    pub fn new(config: &Config, board: B) -> Result<Self, ConfigError> {
        let axis = Axis::new(config)?;
        let state = axis.start();
        Ok(Self { axis, state, board })
    }

    /// One control tick.
    pub fn control_interrupt(&mut self) {
        let sample = self.board.sample();
        let output = self.axis.step(&mut self.state, sample);
        self.board.drive(output.bridge, output.duty);
    }

    /// Asks for a motion, a commissioning, or a stop. Nothing has changed if it is refused.
    pub fn command(&mut self, command: &Command) -> Result<(), Refusal> {
        self.axis.command(&mut self.state, command)
    }

    /// The latched fault.
    pub fn fault(&self) -> Fault {
        self.state.fault()
    }
}
