//! What a pin table is made of, and how it becomes registers. Each board of [`super::chosen`] has its own: what the image sets
//! up, what the tests check against the data sheet (DS8626, table 9) and what the board's page shows. STM32F405RG, LQFP64.

/// A GPIO port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Port {
    /// GPIOA.
    A,
    /// GPIOB.
    B,
    /// GPIOC.
    C,
    /// GPIOD.
    D,
    /// GPIOH: the crystal alone.
    H,
}

/// One pin of a port, 0 … 15.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pin(pub Port, pub u8);

/// What the pin is switched to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Alternate function 0 … 15.
    Alternate(u8),
    /// Push-pull output.
    Output,
    /// Digital input.
    Input,
    /// Analogue input.
    Analog,
    /// Left as it is after reset.
    AsReset,
}

/// Resistor inside the chip, about 40 kΩ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pull {
    /// None.
    None,
    /// To 3.3 V.
    Up,
    /// To ground.
    Down,
}

/// Who needs the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Every image.
    Always,
    /// An image with at least this axis (counted from 0).
    Axis(u8),
    /// The low sides of discrete bridges.
    LowSide,
}

/// One row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// The pin.
    pub pin: Pin,
    /// The chip's name of the signal, as in the data sheet; `GPIO` for a plain pin.
    pub signal: &'static str,
    /// What the pin is switched to.
    pub mode: Mode,
    /// Resistor inside the chip.
    pub pull: Pull,
    /// Who needs it.
    pub needed: Use,
    /// What it is for.
    pub role: &'static str,
}

/// A row.
pub const fn line(
    pin: Pin,
    signal: &'static str,
    mode: Mode,
    pull: Pull,
    needed: Use,
    role: &'static str,
) -> Line {
    Line { pin, signal, mode, pull, needed, role }
}

/// Register values of one port, with the bits that they cover.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PortSetup {
    /// Pins that are set up, one bit each.
    pub pins: u16,
    /// MODER, two bits a pin.
    pub mode: u32,
    /// PUPDR, two bits a pin.
    pub pull: u32,
    /// OSPEEDR, two bits a pin.
    pub speed: u32,
    /// AFRL and AFRH together, four bits a pin.
    pub alternate: u64,
}

/// Every bit of `pins` widened to a field of `width` bits of ones.
pub const fn fields(pins: u16, width: u32) -> u64 {
    let mut mask = 0;
    let mut number = 0;
    while number < 16 {
        if pins & (1 << number) != 0 {
            mask |= ((1 << width) - 1) << (number * width);
        }
        number += 1;
    }
    mask
}

/// Registers of `port` for an image with `axes` axes of a board with these lines, with or without the low sides of discrete
/// bridges.
pub const fn port_setup(lines: &[Line], port: Port, axes: u8, low_sides: bool) -> PortSetup {
    let mut setup = PortSetup { pins: 0, mode: 0, pull: 0, speed: 0, alternate: 0 };
    let mut index = 0;
    while index < lines.len() {
        let line = &lines[index];
        let wanted = match line.needed {
            Use::Always => true,
            Use::Axis(axis) => axis < axes,
            Use::LowSide => low_sides,
        };
        if wanted && line.pin.0 as u8 == port as u8 {
            add(&mut setup, line);
        }
        index += 1;
    }
    setup
}

/// MODER: 00 input, 01 output, 10 alternate, 11 analogue. PUPDR: 01 up, 10 down. OSPEEDR: 01 is 25 MHz, more than 20 kHz
/// and 1 Mbaud need, and kind to the wires. RM0090 section 8.4.
const fn add(setup: &mut PortSetup, line: &Line) {
    let number = line.pin.1;
    let (mode, speed, function) = match line.mode {
        Mode::Input => (0b00, 0b00, 0),
        // DS8626: PC13 to PC15 drive no faster than 2 MHz.
        Mode::Output if matches!(line.pin, Pin(Port::C, 13..=15)) => (0b01, 0b00, 0),
        Mode::Output => (0b01, 0b01, 0),
        Mode::Alternate(function) => (0b10, 0b01, function),
        Mode::Analog => (0b11, 0b00, 0),
        Mode::AsReset => return,
    };
    let pull = match line.pull {
        Pull::None => 0b00,
        Pull::Up => 0b01,
        Pull::Down => 0b10,
    };
    setup.pins |= 1 << number;
    setup.mode |= mode << (2 * number);
    setup.speed |= speed << (2 * number);
    setup.pull |= pull << (2 * number);
    setup.alternate |= (function as u64) << (4 * number);
}
