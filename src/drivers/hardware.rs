//! One axis of a board as a value: what is read at the start of a control tick and what is set at its end.

use super::bridge::{Error, HBridge};
use super::encoder::{Counter, Encoder};
use super::sense::{Converter, CurrentSensor, SupplySense};
use crate::axis::{Bridge, Sample};
use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;

/// Bridge, encoder and sensors of one axis. Boards with several axes hold an array of them.
pub struct AxisHardware<A, B, E, C, I, V> {
    /// The power stage.
    pub bridge: HBridge<A, B, E>,
    /// The position sensor.
    pub encoder: Encoder<C>,
    /// The winding current.
    pub current: I,
    /// The supply voltage.
    pub supply: SupplySense<V>,
}

impl<A, B, E, C, I, V> AxisHardware<A, B, E, C, I, V>
where
    A: SetDutyCycle,
    B: SetDutyCycle,
    E: OutputPin,
    C: Counter,
    I: CurrentSensor,
    V: Converter,
{
    /// The raw integers of this moment.
    pub fn sample(&mut self) -> Sample {
        Sample { count: self.encoder.read(), vbus_raw: self.supply.read(), current_raw: self.current.read() }
    }

    /// Sets the bridge.
    ///
    /// # Errors
    /// A line that refused; the bridge is then off as far as the other lines allow.
    pub fn apply(&mut self, bridge: Bridge, duty: i16) -> Result<(), Error> {
        self.current.follow(bridge, duty);
        self.bridge.apply(bridge, duty)
    }
}
