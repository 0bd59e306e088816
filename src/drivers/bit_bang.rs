//! SPI in mode 1 over plain pins: for a few frames at the start, where the board's pins are none of an SPI peripheral or the
//! peripheral is not worth its code. 16 bits a word, the highest first.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};

/// Half a clock: 1 MHz, a tenth of what a DRV8301 allows.
const HALF_NS: u32 = 500;
/// Between two frames; a DRV8301 wants 400 ns.
const APART_NS: u32 = 1_000;

/// A device behind four pins, three of which may be shared with others.
pub struct BitBang<O, I, D> {
    clock: O,
    out: O,
    input: I,
    select: O,
    delay: D,
}

/// A pin refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PinRefused;

impl Error for PinRefused {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl<O: OutputPin, I: InputPin, D: DelayNs> BitBang<O, I, D> {
    /// Takes the pins, the clock low and the select line high.
    pub fn new(clock: O, out: O, input: I, select: O, delay: D) -> Self {
        Self { clock, out, input, select, delay }
    }

    fn exchange(&mut self, word: u16) -> Result<u16, PinRefused> {
        let mut received = 0;
        for bit in (0..16).rev() {
            self.out.set_state((word >> bit & 1 != 0).into()).map_err(refused)?;
            self.clock.set_high().map_err(refused)?;
            self.delay.delay_ns(HALF_NS);
            let high = self.input.is_high().map_err(refused)?;
            received = received << 1 | u16::from(high);
            // Both ends take the bit with this edge.
            self.clock.set_low().map_err(refused)?;
            self.delay.delay_ns(HALF_NS);
        }
        Ok(received)
    }

    fn operate(&mut self, operation: &mut Operation<'_, u16>) -> Result<(), PinRefused> {
        match operation {
            Operation::Read(words) => words.iter_mut().try_for_each(|word| {
                *word = self.exchange(0)?;
                Ok(())
            }),
            Operation::Write(words) => words.iter().try_for_each(|word| self.exchange(*word).map(|_| ())),
            Operation::TransferInPlace(words) => words.iter_mut().try_for_each(|word| {
                *word = self.exchange(*word)?;
                Ok(())
            }),
            Operation::Transfer(read, write) => {
                for number in 0..read.len().max(write.len()) {
                    let received = self.exchange(write.get(number).copied().unwrap_or(0))?;
                    read.get_mut(number).into_iter().for_each(|word| *word = received);
                }
                Ok(())
            }
            Operation::DelayNs(nanoseconds) => {
                self.delay.delay_ns(*nanoseconds);
                Ok(())
            }
        }
    }
}

fn refused<E>(_: E) -> PinRefused {
    PinRefused
}

impl<O, I, D> ErrorType for BitBang<O, I, D> {
    type Error = PinRefused;
}

impl<O: OutputPin, I: InputPin, D: DelayNs> SpiDevice<u16> for BitBang<O, I, D> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u16>]) -> Result<(), PinRefused> {
        self.select.set_low().map_err(refused)?;
        self.delay.delay_ns(HALF_NS);
        let result = operations.iter_mut().try_for_each(|operation| self.operate(operation));
        let released = self.select.set_high().map_err(refused);
        self.delay.delay_ns(APART_NS);
        result.and(released)
    }
}
