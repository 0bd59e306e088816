//! What a board is made of, as types: the pins, counters, converters and timers behind the drivers of its axes.

use super::encoder::Counter;
use super::sense::{Converter, CurrentSensor};
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::pwm::SetDutyCycle;

/// The parts of one kind of board.
pub trait Parts {
    /// A PWM line.
    type Pwm: SetDutyCycle;
    /// The enable or sleep line of a bridge.
    type Enable: OutputPin;
    /// A quadrature counter.
    type Counter: Counter;
    /// The winding current of an axis.
    type Current: CurrentSensor;
    /// The converter of the supply.
    type Supply: Converter;
    /// A digital input: fault, enable contact, index.
    type Input: InputPin;
    /// What switches the bridges off without the program.
    type Breaker: Breaker;
}

/// What several bridges share: a timer whose outputs a fault line switches off in hardware, until the program lets them
/// follow again. A board without such an input has a breaker that never trips; its fault line is read.
pub trait Breaker {
    /// Has it switched the outputs off since [`Breaker::clear`]?
    fn has_tripped(&self) -> bool;
    /// Forgets that it has. Where the line is still active it trips again at once.
    fn clear(&mut self);
    /// Lets the outputs follow, if that is not the enable line of the bridge. Without effect while the line is active.
    fn enable(&mut self);
    /// Are the current sensors of its axes on? Amplifiers inside of gate drivers are off with them, and read anything.
    fn measures(&self) -> bool {
        true
    }
}
