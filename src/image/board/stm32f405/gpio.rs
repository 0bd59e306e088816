//! Pins: the table of [`super::pins`] becomes registers, and single lines become `embedded-hal` pins.

use super::board::PINS;
use super::pac::{GPIOA, GPIOB, GPIOC, GPIOD, GPIOH, gpioi::RegisterBlock};
use super::pins::{Pin, Port, PortSetup, fields, port_setup};
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};

/// Registers of a port.
fn registers(port: Port) -> &'static RegisterBlock {
    let address = match port {
        Port::A => GPIOA::ptr() as usize,
        Port::B => GPIOB::ptr() as usize,
        Port::C => GPIOC::ptr() as usize,
        Port::D => GPIOD::ptr() as usize,
        Port::H => GPIOH::ptr() as usize,
    };
    // SAFETY: all ports have the same register map (RM0090 section 8.4.11), differing in reset values alone, and the
    // addresses are valid for the life of the program.
    unsafe { &*(address as *const RegisterBlock) }
}

/// Ports with pins of a board.
const PORTS: [Port; 4] = [Port::A, Port::B, Port::C, Port::D];

const fn ports(axes: u8, low_sides: bool) -> [PortSetup; 4] {
    let mut setups = [port_setup(PINS, Port::A, axes, low_sides); 4];
    let mut number = 1;
    while number < PORTS.len() {
        setups[number] = port_setup(PINS, PORTS[number], axes, low_sides);
        number += 1;
    }
    setups
}

/// True if the board has pins on this port.
pub const fn uses(port: Port) -> bool {
    port_setup(PINS, port, 4, true).pins != 0
}

/// Sets up every pin that an image with `N` axes needs, 1 … 4; the others stay as they are after reset. The registers are worked
/// out when the image is built, for its own number of axes, so the table of pins takes no flash.
pub fn set_up<const N: usize>(low_sides: bool) {
    let setups = const { [ports(N as u8, false), ports(N as u8, true)] };
    for (port, setup) in PORTS.into_iter().zip(setups[usize::from(low_sides)]) {
        if setup.pins != 0 {
            apply(port, setup);
        }
    }
}

/// Function before mode, so that no pin drives a wrong signal in between. Outputs are low: ODR is 0 after reset.
fn apply(port: Port, setup: PortSetup) {
    let port = registers(port);
    let twos = fields(setup.pins, 2) as u32;
    let fours = fields(setup.pins, 4);
    // SAFETY: every value lies within its mask and every code is defined for its register (RM0090 section 8.4).
    unsafe {
        port.afrl().modify(|r, w| w.bits((r.bits() & !(fours as u32)) | setup.alternate as u32));
        port.afrh()
            .modify(|r, w| w.bits((r.bits() & !((fours >> 32) as u32)) | (setup.alternate >> 32) as u32));
        port.pupdr().modify(|r, w| w.bits((r.bits() & !twos) | setup.pull));
        port.ospeedr().modify(|r, w| w.bits((r.bits() & !twos) | setup.speed));
        port.moder().modify(|r, w| w.bits((r.bits() & !twos) | setup.mode));
    }
}

/// One pin as `embedded-hal` sees it. Writes go through BSRR and so are atomic.
#[derive(Clone, Copy, Debug)]
pub struct Wire(pub Pin);

impl Wire {
    /// Its place in a register of the port.
    fn bit(self) -> u32 {
        1 << (self.0.1 & 15)
    }

    /// Drives the pin from any context.
    pub fn drive(self, high: bool) {
        let bit = self.bit();
        let word = if high { bit } else { bit << 16 };
        // SAFETY: BSRR is write-only and touches this pin alone (RM0090 section 8.4.7).
        registers(self.0.0).bsrr().write(|w| unsafe { w.bits(word) });
    }

    /// True if the pin is high.
    pub fn level(self) -> bool {
        registers(self.0.0).idr().read().bits() & self.bit() != 0
    }
}

impl ErrorType for Wire {
    type Error = Infallible;
}

impl OutputPin for Wire {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.drive(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.drive(true);
        Ok(())
    }
}

impl InputPin for Wire {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.level())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.level())
    }
}
